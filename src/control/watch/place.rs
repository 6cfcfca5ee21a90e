//! Where the sockets of this user's sessions are.

use std::fs::{self, DirBuilder, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketType};
use rustix::process::{Pid, geteuid, test_kill_process};

use super::WatchError;

/// The longest path that every system takes for a socket, bytes, its end included.
const LONGEST_PATH: usize = 104;
/// As long as a socket's name may become.
const LONGEST_NAME: &str = "4294967295-4294967295.sock";
/// What a socket's name ends in.
const ENDING: &str = "sock";

/// The folders in which sockets may be, the preferred one first: only this user may enter them.
#[derive(Clone, Debug)]
pub struct Place {
    folders: Vec<PathBuf>,
}

impl Place {
    /// The place on this computer: the user's runtime folder, or else the usual one, or else one
    /// in the folder for temporary files.
    #[must_use]
    pub fn here() -> Self {
        let runtime = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
        Self::of(runtime, std::env::temp_dir(), geteuid().as_raw())
    }

    /// The place of the user `uid`. Not every shell knows the `runtime` folder that a session's
    /// had, so that the usual one is among them.
    fn of(runtime: Option<PathBuf>, temporary: PathBuf, uid: u32) -> Self {
        let usual = PathBuf::from(format!("/run/user/{uid}"));
        let runtimes = runtime.filter(|folder| folder.is_absolute()).into_iter().chain([usual]);
        let runtimes = runtimes.map(|folder| folder.join("coadapt"));
        let others = [temporary, PathBuf::from("/tmp")];
        let others = others.map(|folder| folder.join(format!("coadapt-{uid}")));
        let mut folders = Vec::new();
        for folder in runtimes.chain(others) {
            if !folders.contains(&folder) {
                folders.push(folder);
            }
        }
        Self::at(folders)
    }

    /// The place with these folders.
    #[must_use]
    pub fn at(folders: impl IntoIterator<Item = PathBuf>) -> Self {
        let fits = |folder: &PathBuf| {
            folder.join(LONGEST_NAME).as_os_str().len() < LONGEST_PATH && folder.is_absolute()
        };
        Self { folders: folders.into_iter().filter(fits).collect() }
    }

    /// The folders, those first that are preferred.
    #[must_use]
    pub fn folders(&self) -> &[PathBuf] {
        &self.folders
    }

    /// The first folder that is this user's alone, made where there is none.
    ///
    /// # Errors
    /// When there is none such.
    pub fn open(&self) -> Result<&Path, WatchError> {
        let mut why = "none has a path that is short enough for a socket".to_owned();
        for folder in &self.folders {
            match own(folder) {
                Ok(()) => return Ok(folder),
                Err(cause) => why = format!("{}: {cause}", folder.display()),
            }
        }
        Err(WatchError::NoFolder(why))
    }

    /// The sockets of sessions that may still run. Those of programs that were killed are removed.
    #[must_use]
    pub fn sockets(&self) -> Vec<PathBuf> {
        let safe = self.folders.iter().filter(|folder| is_own(folder).is_ok());
        let mut sockets: Vec<PathBuf> = safe
            .flat_map(|folder| fs::read_dir(folder).into_iter().flatten().flatten())
            .map(|entry| entry.path())
            .filter(|path| path.extension().is_some_and(|ending| ending == ENDING))
            .filter(|path| !is_stale(path))
            .collect();
        sockets.sort();
        sockets
    }
}

/// The name of this program's socket number `number`.
pub(super) fn name(number: u32) -> String {
    format!("{}-{number}.{ENDING}", std::process::id())
}

/// Makes `folder` one that only this user may enter.
fn own(folder: &Path) -> io::Result<()> {
    match DirBuilder::new().mode(0o700).create(folder) {
        Err(cause) if cause.kind() != io::ErrorKind::AlreadyExists => return Err(cause),
        _ => {}
    }
    let facts = fs::symlink_metadata(folder)?;
    if facts.is_dir() && facts.uid() == geteuid().as_raw() && facts.mode() & 0o777 != 0o700 {
        fs::set_permissions(folder, Permissions::from_mode(0o700))?;
    }
    is_own(folder)
}

/// Whether only this user may enter `folder`: in a folder for all, others may have made it.
fn is_own(folder: &Path) -> io::Result<()> {
    let facts = fs::symlink_metadata(folder)?;
    let is_ours = facts.is_dir() && facts.uid() == geteuid().as_raw();
    if is_ours && facts.mode() & 0o777 == 0o700 {
        return Ok(());
    }
    Err(io::Error::new(io::ErrorKind::PermissionDenied, "others may enter it, or made it"))
}

/// Whether nobody will ever answer at `socket`; it is then removed.
fn is_stale(socket: &Path) -> bool {
    let maker = pid_of(socket).and_then(Pid::from_raw);
    let is_gone = maker.is_none_or(|pid| test_kill_process(pid) == Err(Errno::SRCH));
    let is_stale = is_gone && knock(socket).is_err_and(|why| why == Errno::CONNREFUSED);
    if is_stale {
        let _ = fs::remove_file(socket);
    }
    is_stale
}

/// The program that made `socket`, by the socket's name.
pub(super) fn pid_of(socket: &Path) -> Option<i32> {
    socket.file_name()?.to_str()?.split('-').next()?.parse().ok()
}

/// Connects to `socket` without waiting: who is stopped lets no more than a few come in, and
/// the others wait at the door for ever.
///
/// # Errors
/// `AGAIN` when too many wait there already; otherwise as the system says.
pub(super) fn knock(socket: &Path) -> Result<UnixStream, Errno> {
    let waits = |stream: &UnixStream, may: bool| {
        let set = stream.set_nonblocking(!may);
        set.map_err(|error| Errno::from_io_error(&error).unwrap_or(Errno::IO))
    };
    let stream =
        UnixStream::from(rustix::net::socket(AddressFamily::UNIX, SocketType::STREAM, None)?);
    rustix::io::fcntl_setfd(&stream, rustix::io::FdFlags::CLOEXEC)?;
    waits(&stream, false)?;
    rustix::net::connect(&stream, &SocketAddrUnix::new(socket)?)?;
    waits(&stream, true)?;
    Ok(stream)
}

/// Whether the other end of `stream` is a program of this user. Where the system does not tell,
/// the folder's rights stand alone.
pub(super) fn is_peer_own(stream: &UnixStream) -> bool {
    #[cfg(target_os = "linux")]
    {
        rustix::net::sockopt::socket_peercred(stream).is_ok_and(|peer| peer.uid == geteuid())
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = stream;
        true
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;

    use super::*;

    #[test]
    fn a_folder_that_others_may_enter_is_closed_to_them_or_passed_over() {
        let desk = tempfile::tempdir().unwrap();
        let open = desk.path().join("open");
        DirBuilder::new().mode(0o755).create(&open).unwrap();
        assert_eq!(Place::at([open.clone()]).open().unwrap(), open);
        assert_eq!(fs::metadata(&open).unwrap().mode() & 0o777, 0o700);
        // A link may lead to where others wrote.
        let link = desk.path().join("link");
        std::os::unix::fs::symlink(&open, &link).unwrap();
        let error = Place::at([link]).open().unwrap_err().to_string();
        assert!(error.contains("XDG_RUNTIME_DIR"), "{error}");
    }

    #[test]
    fn the_usual_runtime_folder_is_among_them_whatever_the_shell_knows() {
        let folders = |runtime: Option<&str>| {
            let place = Place::of(runtime.map(PathBuf::from), "/tmp".into(), 1234);
            let folders = place.folders().iter();
            folders.map(|folder| folder.display().to_string()).collect::<Vec<_>>()
        };
        let usual = ["/run/user/1234/coadapt", "/tmp/coadapt-1234"];
        for runtime in [None, Some("/run/user/1234"), Some("not/from/the/root")] {
            assert_eq!(folders(runtime), usual);
        }
        assert_eq!(folders(Some("/my/own")), ["/my/own/coadapt", usual[0], usual[1]]);
    }

    #[test]
    fn who_lets_nobody_in_is_not_waited_for() {
        let desk = tempfile::tempdir().unwrap();
        let socket = desk.path().join(name(1));
        let _stopped = UnixListener::bind(&socket).unwrap();
        let mut inside = Vec::new();
        // The system lets some wait at the door, and says so once they are too many.
        let refused = loop {
            match knock(&socket) {
                Ok(stream) => inside.push(stream),
                Err(why) => break why,
            }
            assert!(inside.len() < 10_000);
        };
        assert!([Errno::AGAIN, Errno::CONNREFUSED].contains(&refused), "{refused}");
    }

    #[test]
    fn a_folder_too_deep_for_a_socket_is_passed_over() {
        let desk = tempfile::tempdir().unwrap();
        let (deep, near) = (desk.path().join("x".repeat(90)), desk.path().join("near"));
        assert_eq!(Place::at([deep, near.clone()]).open().unwrap(), near);
    }

    #[test]
    fn sockets_of_killed_programs_are_removed_and_others_stay() {
        let desk = tempfile::tempdir().unwrap();
        let folder = desk.path().join("s");
        let place = Place::at([folder.clone()]);
        place.open().unwrap();
        // No process has the largest number.
        let (dead, alive) = (folder.join("2147483647-1.sock"), folder.join(name(1)));
        drop(UnixListener::bind(&dead).unwrap());
        let listener = UnixListener::bind(&alive).unwrap();
        fs::write(folder.join("notes.txt"), "").unwrap();
        assert_eq!(place.sockets(), std::slice::from_ref(&alive));
        assert!(!dead.exists());
        drop(listener);
        // Its program lives: it may be about to listen.
        assert_eq!(place.sockets(), [alive]);
    }
}

//! Who is logged in, and in which groups.

use super::Host;

/// The user and their groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Login {
    /// The user's name; `$USER` where it is not known, which a shell replaces.
    pub user: String,
    /// Whether it is the superuser, who may do everything.
    pub is_root: bool,
    /// The groups that this login has.
    now: Vec<String>,
    /// Those that the next login will have.
    next: Vec<String>,
}

/// How somebody stands to a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Membership {
    /// There is no such group here.
    NoGroup,
    /// Not a member.
    Outside,
    /// A member, but this login is older than that.
    NextLogin,
    /// A member.
    Member,
}

/// A line of `/etc/group`.
pub(super) struct Group<'a> {
    pub name: &'a str,
    pub id: u32,
    members: &'a str,
}

/// The lines of `/etc/group`.
pub(super) fn groups(text: &str) -> impl Iterator<Item = Group<'_>> {
    text.lines().filter_map(|line| {
        let mut cells = line.split(':');
        let name = cells.next()?;
        let id = cells.nth(1)?.parse().ok()?;
        Some(Group { name, id, members: cells.next().unwrap_or("") })
    })
}

impl Login {
    /// Who runs the program on `host`, by `/proc/self/status`, `/etc/passwd` and `/etc/group`.
    #[must_use]
    pub fn on(host: &Host) -> Self {
        let status = host.text("/proc/self/status").unwrap_or_default();
        let numbers = |key: &str| -> Vec<u32> {
            let line = status.lines().find_map(|line| line.strip_prefix(key)).unwrap_or("");
            line.split_whitespace().filter_map(|number| number.parse().ok()).collect()
        };
        let (users, own, more) = (numbers("Uid:"), numbers("Gid:"), numbers("Groups:"));
        let id = users.first().copied();
        let passwd = host.text("/etc/passwd").unwrap_or_default();
        let named = passwd.lines().find_map(|line| {
            let mut cells = line.split(':');
            let name = cells.next()?;
            (cells.nth(1)?.parse().ok() == id).then(|| name.to_owned())
        });
        let user = named
            .or_else(|| host.variable("USER").map(str::to_owned))
            .unwrap_or_else(|| "$USER".to_owned());
        let text = host.text("/etc/group").unwrap_or_default();
        let (mut now, mut next) = (Vec::new(), Vec::new());
        for group in groups(&text) {
            if own.iter().chain(&more).any(|id| *id == group.id) {
                now.push(group.name.to_owned());
            }
            if group.members.split(',').any(|member| member.trim() == user) {
                next.push(group.name.to_owned());
            }
        }
        Self { user, is_root: id == Some(0), now, next }
    }

    /// How this login stands to `group` on `host`.
    #[must_use]
    pub fn membership(&self, host: &Host, group: &str) -> Membership {
        let is_in = |groups: &[String]| groups.iter().any(|known| known == group);
        if is_in(&self.now) {
            Membership::Member
        } else if is_in(&self.next) {
            Membership::NextLogin
        } else if groups(&host.text("/etc/group").unwrap_or_default()).any(|g| g.name == group) {
            Membership::Outside
        } else {
            Membership::NoGroup
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_login_knows_its_groups_and_those_of_the_next_one() {
        let root = tempfile::tempdir().unwrap();
        for folder in ["proc/self", "etc"] {
            fs::create_dir_all(root.path().join(folder)).unwrap();
        }
        let write = |file: &str, text: &str| fs::write(root.path().join(file), text).unwrap();
        write("proc/self/status", "Name:\tx\nUid:\t1000\t1000\nGid:\t1000\t1000\nGroups:\t20 \n");
        write("etc/passwd", "root:x:0:0::/root:/bin/sh\nann:x:1000:1000::/home/ann:/bin/sh\n");
        write("etc/group", "root:x:0:\ndialout:x:20:ann\ninput:x:104:bob,ann\nvideo:x:44:bob\n");
        let host = Host::at(root.path(), &[]);
        let login = Login::on(&host);
        assert_eq!((login.user.as_str(), login.is_root), ("ann", false));
        assert_eq!(login.membership(&host, "dialout"), Membership::Member);
        assert_eq!(login.membership(&host, "input"), Membership::NextLogin);
        assert_eq!(login.membership(&host, "video"), Membership::Outside);
        assert_eq!(login.membership(&host, "uucp"), Membership::NoGroup);
        // Nothing known: a shell fills in the user.
        assert_eq!(Login::on(&Host::at(&root.path().join("none"), &[])).user, "$USER");
    }
}

//! The studies that can be called by a name.

use std::path::Path;

use super::StudyError;
use crate::profile::Text;

/// The studies built into the program.
const BUILT_IN: [(&str, &str); 4] = [
    ("balance", include_str!("../../../profiles/studies/balance.ron")),
    ("mountain-car", include_str!("../../../profiles/studies/mountain-car.ron")),
    ("mountain-car-feasible", include_str!("../../../profiles/studies/mountain-car-feasible.ron")),
    ("swing-up", include_str!("../../../profiles/studies/swing-up.ron")),
];

/// The study called `name_or_path`, in the folder `studies` of `profiles` or built in.
pub(super) fn find(name_or_path: &str, profiles: &Path) -> Result<Text, StudyError> {
    Ok(Text::find("study", name_or_path, &profiles.join("studies"), &BUILT_IN)?)
}

/// The names of all studies: those in the folder `studies` of `profiles` and those that are built
/// in.
#[must_use]
pub fn names(profiles: &Path) -> Vec<String> {
    Text::names(&profiles.join("studies"), &BUILT_IN)
}

//! Which program measured.

use std::sync::LazyLock;

use crate::scene::Fnv;

/// What the program was built from, as far as it can be told.
pub(super) fn build() -> String {
    static OF_EXECUTABLE: LazyLock<String> = LazyLock::new(|| {
        let mut hash = Fnv::default();
        let bytes = std::env::current_exe().and_then(std::fs::read);
        bytes.iter().for_each(|bytes| hash.bytes(bytes));
        format!("executable {:032x}", hash.value())
    });
    option_env!("LUMIVOX_COMMIT").map_or_else(|| OF_EXECUTABLE.clone(), str::to_owned)
}

/// The commit in brackets; nothing for one that is not known.
pub(super) fn commit(build: &str) -> String {
    if build.starts_with("executable ") {
        String::new()
    } else {
        format!(" ({build})")
    }
}

//! Files are written whole or not at all, through links, and a full disk is told.

use std::io::{Error, ErrorKind};
use std::path::Path;

use lumivox::output::{is_same_file, write_file, write_text};

#[test]
fn what_fails_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    write_text(&path, "old").unwrap();
    let failed = write_file(&path, |file| {
        file.write_all(b"new")?;
        Err(Error::other("no"))
    });
    assert_eq!(failed.unwrap_err().to_string(), "no");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_known() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    symlink("file", at("link")).unwrap();
    symlink("link", at("link of a link")).unwrap();
    symlink("circle", at("circle")).unwrap();
    assert!(is_same_file(&at("link of a link"), &at("file")));
    assert!(!is_same_file(&at("link of a link"), &at("other")));
    assert!(!is_same_file(&at("none/file"), &at("none/other")));
    write_text(&at("link of a link"), "text").unwrap();
    assert!(at("link of a link").is_symlink() && !at("file").is_symlink());
    std::fs::hard_link(at("file"), at("hard")).unwrap();
    assert!(is_same_file(&at("hard"), &at("link")));
    std::fs::set_permissions(at("file"), PermissionsExt::from_mode(0o600)).unwrap();
    write_text(&at("link"), "more").unwrap();
    let mode = std::fs::metadata(at("file")).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    assert!(write_text(&at("circle"), "text").is_err());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let full = write_text(Path::new("/dev/full"), "text");
    assert_eq!(full.unwrap_err().kind(), ErrorKind::StorageFull);
}

//! Complete files or none, and paths to the same file.

use hwall_files::{Beside, NewFile, same_file, write};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A folder for a test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("hwall_files_{}_{name}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn names(&self) -> Vec<String> {
        let name = |e: io::Result<fs::DirEntry>| e.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<String> = fs::read_dir(&self.0).unwrap().map(name).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

#[test]
fn a_file_that_is_not_finished_leaves_the_old_one_and_no_trace() {
    let folder = Folder::new("unfinished");
    let path = folder.0.join("a.csv");
    write(&path, "good").unwrap();
    let mut file = NewFile::create(&path).unwrap();
    file.write_all(&[b'x'; 1 << 20]).unwrap();
    file.flush().unwrap();
    assert_eq!(text(&path), "good");
    drop(file);
    assert_eq!(text(&path), "good");
    assert_eq!(folder.names(), ["a.csv"]);

    let mut file = NewFile::create(&path).unwrap();
    file.write_all(b"better").unwrap();
    file.finish().unwrap();
    assert_eq!(text(&path), "better");
    assert_eq!(folder.names(), ["a.csv"]);
}

#[test]
fn a_path_that_others_open_is_renamed_as_well() {
    let folder = Folder::new("beside");
    let path = folder.0.join("b.svg");
    let beside = Beside::new(&path).unwrap();
    fs::write(beside.path(), "drawn").unwrap();
    assert!(!path.exists());
    beside.finish().unwrap();
    assert_eq!(text(&path), "drawn");
}

#[test]
fn folders_and_missing_folders_are_refused() {
    let folder = Folder::new("refused");
    assert!(write(&folder.0, "x").is_err());
    assert!(write(folder.0.join("none/x"), "x").is_err());
    assert!(write("", "x").is_err());
    assert_eq!(folder.names(), Vec::<String>::new());
}

#[cfg(unix)]
#[test]
fn links_and_permissions_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::new("links");
    let (file, link) = (folder.0.join("real"), folder.0.join("link"));
    write(&file, "1").unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
    symlink(&file, &link).unwrap();
    write(&link, "2").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(text(&file), "2");
    let mode = fs::metadata(&file).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    // A dangling link is written through; a link to itself is refused.
    let (new, loose) = (folder.0.join("new"), folder.0.join("loose"));
    symlink("new", &loose).unwrap();
    write(&loose, "3").unwrap();
    assert_eq!(text(&new), "3");
    let circle = folder.0.join("circle");
    symlink("circle", &circle).unwrap();
    assert!(write(&circle, "4").is_err());
}

#[cfg(unix)]
#[test]
fn devices_are_written_directly() {
    write("/dev/null", "x").unwrap();
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
}

#[test]
fn one_file_by_several_names() {
    let folder = Folder::new("same");
    let (a, b) = (folder.0.join("a"), folder.0.join("b"));
    write(&a, "1").unwrap();
    write(&b, "1").unwrap();
    let again = folder.0.join(".").join("a");
    assert!(same_file(&a, &a) && same_file(&a, &again) && !same_file(&a, &b));
    // Neither exists.
    let (c, d) = (folder.0.join("c"), folder.0.join("./c"));
    assert!(same_file(&c, &d) && !same_file(&c, &a));
    assert!(!same_file("", &a));
    fs::hard_link(&a, folder.0.join("hard")).unwrap();
    if cfg!(unix) {
        assert!(same_file(&a, folder.0.join("hard")));
    }
}

//! The files that a program will read and write, checked before it starts.

use anyhow::{Context, bail, ensure};
use hwall_files::{Beside, same_file};
use std::fmt;
use std::fs::metadata;
use std::path::{Path, PathBuf};

/// The files of a command line by their flags; [`check`](Self::check) before the first is opened.
#[derive(Debug, Clone, Default)]
pub struct FilePlan {
    read: Vec<Named>,
    /// Files that are read if they exist.
    beside: Vec<Named>,
    written: Vec<Named>,
    /// Folders that the program creates before it writes.
    made: Vec<Named>,
}

#[derive(Debug, Clone)]
struct Named {
    flag: &'static str,
    path: PathBuf,
}

impl FilePlan {
    /// Adds a file that is read, if there is one; of a folder, the tables in it.
    #[must_use]
    pub fn read(mut self, flag: &'static str, path: Option<&Path>) -> Self {
        self.read.extend(Named::of(flag, path));
        self
    }

    /// Adds a scene with the files of the same name beside it, if there is one.
    #[must_use]
    pub fn read_scene(mut self, flag: &'static str, path: Option<&Path>) -> Self {
        let beside = |extension| path.map(|path| path.with_extension(extension));
        for path in [beside("toml"), beside("mtl")] {
            self.beside.extend(Named::of(flag, path.as_deref()));
        }
        self.read(flag, path)
    }

    /// Adds an arm, which is a file if its name ends in `.urdf`.
    #[must_use]
    pub fn read_arm(self, flag: &'static str, arm: &str) -> Self {
        let is_file = arm.to_ascii_lowercase().ends_with(".urdf");
        self.read(flag, is_file.then_some(Path::new(arm)))
    }

    /// Adds a file that is written, if there is one. Its folder exists or is one of [`write_into`](Self::write_into).
    #[must_use]
    pub fn write(mut self, flag: &'static str, path: Option<&Path>) -> Self {
        self.written.extend(Named::of(flag, path));
        self
    }

    /// Adds files that are written into a folder, if there is one; the program creates a missing folder before it
    /// writes anything.
    #[must_use]
    pub fn write_into(mut self, flag: &'static str, folder: Option<&Path>, names: &[&str]) -> Self {
        let Some(folder) = folder else { return self };
        self.made.extend(Named::of(flag, Some(folder)));
        names.iter().fold(self, |plan, name| {
            plan.write(flag, Some(&folder.join(name)))
        })
    }

    /// Checks that every input exists, every output can be written, and none of them is an input or another output.
    ///
    /// # Errors
    /// A missing input; an output that is also an input or another output; an output that cannot be written. Found before minutes
    /// of work instead of after them.
    pub fn check(&self) -> anyhow::Result<()> {
        for (place, output) in self.written.iter().enumerate() {
            let mut inputs = self.read.iter().chain(&self.beside);
            if let Some(Named { flag, .. }) = inputs.find(|i| i.holds(&output.path)) {
                bail!("{output} is a file that {flag} reads; write to another one");
            }
            let mut others = self.written[..place].iter();
            if let Some(other) = others.find(|other| same_file(&other.path, &output.path)) {
                bail!("{output} is also what {} writes", other.flag);
            }
        }
        for input in &self.read {
            metadata(&input.path).with_context(|| input.to_string())?;
        }
        for folder in &self.made {
            makeable(&folder.path).with_context(|| folder.to_string())?;
        }
        for output in &self.written {
            let text = output.path.to_string_lossy();
            if text.ends_with(std::path::is_separator) {
                bail!("{output} names a folder, not a file");
            }
            // The file created here is removed again at once.
            match output.path.parent() {
                Some(folder) if !folder.as_os_str().is_empty() && !folder.exists() => {
                    ensure!(self.makes(folder), "{output}: no such folder");
                }
                _ => drop(Beside::new(&output.path).with_context(|| output.to_string())?),
            }
        }
        Ok(())
    }

    /// Will this folder, or one below it, be created before anything is written?
    fn makes(&self, folder: &Path) -> bool {
        let made = self.made.iter();
        made.flat_map(|made| made.path.ancestors())
            .any(|made| made == folder)
    }
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.flag, self.path.display())
    }
}

impl Named {
    fn of(flag: &'static str, path: Option<&Path>) -> Option<Self> {
        let path = path?.to_owned();
        Some(Self { flag, path })
    }

    /// Is the file an input, by itself or as a table in a folder?
    fn holds(&self, file: &Path) -> bool {
        if same_file(&self.path, file) {
            return true;
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let table = name.ends_with(".csv") || name.ends_with("_meta.json");
        let within = file.ancestors().skip(1);
        table
            && file.exists()
            && within
                .into_iter()
                .any(|folder| same_file(&self.path, folder))
    }
}

/// Checks that this folder, or its nearest existing parent, can be written to.
fn makeable(folder: &Path) -> anyhow::Result<()> {
    let exists = |path: &&Path| path.exists();
    let here = Path::new(".");
    let nearest = folder
        .ancestors()
        .filter(|path| !path.as_os_str().is_empty())
        .find(exists)
        .unwrap_or(here);
    if !nearest.is_dir() {
        bail!("{} is no folder", nearest.display());
    }
    // A unique name.
    drop(Beside::new(
        nearest.join(format!(".hwall-can-write-{}", std::process::id())),
    )?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("hwall_plan_{}_{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        path
    }

    fn said(plan: &FilePlan) -> String {
        plan.check().unwrap_err().to_string()
    }

    #[test]
    fn an_output_that_is_an_input_is_refused_by_name() {
        let folder = scratch("same");
        let (a, b) = (folder.join("z.csv"), folder.join("y.csv"));
        std::fs::write(&a, "q1\n1\n").unwrap();
        let plan = FilePlan::default().read("--in", Some(&a));
        let again = folder.join(".").join("z.csv");
        let text = said(&plan.clone().write("--out", Some(&again)));
        assert!(text.contains("--out") && text.contains("--in"), "{text}");
        plan.clone().write("--out", Some(&b)).check().unwrap();
        plan.write("--out", None).check().unwrap();
        assert_eq!(std::fs::read_to_string(&a).unwrap(), "q1\n1\n");
        assert!(!b.exists());
    }

    /// Regression: `out/hwall` blocked `out/door`.
    #[test]
    fn a_folder_beside_one_of_any_name_can_be_made() {
        let folder = scratch("beside");
        std::fs::create_dir_all(folder.join("hwall")).unwrap();
        let door = folder.join("door");
        let plan = FilePlan::default().write_into("--out", Some(&door), &["door.svg"]);
        plan.check().unwrap();
        assert!(!door.exists());
    }

    #[test]
    fn an_output_among_the_tables_of_a_folder_is_refused() {
        let folder = scratch("tables");
        let table = folder.join("train-1.csv");
        std::fs::write(&table, "a\n").unwrap();
        let plan = FilePlan::default().read("--train", Some(&folder));
        assert!(said(&plan.clone().write("--out", Some(&table))).contains("--train"));
        let new = folder.join("result.csv");
        plan.write("--out", Some(&new)).check().unwrap();
    }

    #[test]
    fn two_outputs_of_one_name_are_refused() {
        let path = scratch("two").join("x");
        let plan = FilePlan::default().write("--json", Some(&path));
        let text = said(&plan.write("--md", Some(&path)));
        assert!(text.contains("--json") && text.contains("--md"), "{text}");
    }

    #[test]
    fn an_output_that_cannot_be_written_is_named_before_the_work() {
        let folder = scratch("unwritable");
        std::fs::write(folder.join("file"), "").unwrap();
        let paths = ["file/x", "file/x/y", "new/"].map(|name| folder.join(name));
        for path in paths.iter().chain([&folder]) {
            let text = said(&FilePlan::default().write("--out", Some(path)));
            assert!(text.contains("--out"), "{text}");
        }
        let deep = folder.join("new/deep");
        let plan = FilePlan::default().write_into("--out", Some(&deep), &["a", "b"]);
        plan.check().unwrap();
        let beside = plan.clone().write("--json", Some(&deep.join("c")));
        beside.check().unwrap();
        let elsewhere = plan.write("--json", Some(&folder.join("missing/c")));
        assert!(said(&elsewhere).contains("--json"));
        assert!(!folder.join("new").exists());
    }

    #[test]
    fn an_arm_is_a_file_only_if_it_is_no_name() {
        let folder = scratch("arm");
        let urdf = folder.join("arm.URDF");
        let plan = FilePlan::default().read_arm("--arm", &urdf.to_string_lossy());
        assert!(said(&plan.write("--out", Some(&urdf))).contains("--arm"));
        let plan = FilePlan::default().read_arm("--arm", "iiwa7");
        plan.write("--out", Some(Path::new("iiwa7")))
            .check()
            .unwrap();
    }

    #[test]
    fn a_scene_is_read_with_the_files_beside_it() {
        let folder = scratch("scene");
        let obj = folder.join("room.obj");
        let plan = FilePlan::default().read_scene("--scene", Some(&obj));
        let toml = folder.join("room.toml");
        assert!(said(&plan.write("--json", Some(&toml))).contains("--scene"));
    }
}

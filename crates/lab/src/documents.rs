//! Destination of the documents of studies and measurements: `out/`, or on request the tracked documents.

use anyhow::{Context, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The folder of the tracked documents, from the root of the project.
const TRACKED: &str = "docs";
/// A file that identifies the root of this project.
const OF_THE_PROJECT: &str = "docs/ARCHITECTURE.md";
/// The tracked README, which quotes a generated figure.
const README: &str = "README.md";

/// Flags for the destination of a document.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Destination {
    /// Folder for the document and its figures/ [default: a separate folder in out/]
    #[arg(long)]
    out: Option<PathBuf>,
    /// Overwrite the tracked documents instead: docs/, and the figures that README.md and docs/CRATES.md quote
    #[arg(long, conflicts_with = "out")]
    docs: bool,
}

impl Destination {
    /// The requested folder, not created yet; by default `default`.
    pub fn folder<'a>(&'a self, default: &'a str) -> &'a Path {
        match &self.out {
            _ if self.docs => Path::new(TRACKED),
            Some(folder) => folder,
            None => Path::new(default),
        }
    }

    /// The requested folder; by default `default`.
    ///
    /// # Errors
    /// A folder that cannot be created; `--docs` outside the project's root.
    pub fn open(&self, default: impl AsRef<Path>) -> anyhow::Result<Documents> {
        match &self.out {
            _ if self.docs => Documents::tracked(),
            Some(folder) => Documents::in_folder(folder),
            None => Documents::in_folder(default),
        }
    }
}

/// A folder for documents, with their figures below it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Documents {
    folder: PathBuf,
    readme: Option<PathBuf>,
}

impl Documents {
    /// Any folder, created if missing.
    ///
    /// # Errors
    /// A folder that cannot be created.
    pub fn in_folder(folder: impl AsRef<Path>) -> anyhow::Result<Self> {
        let folder = folder.as_ref().to_owned();
        make(&folder)?;
        Ok(Self {
            folder,
            readme: None,
        })
    }

    /// The tracked documents of the project.
    ///
    /// # Errors
    /// The working directory is not the root of the project.
    pub fn tracked() -> anyhow::Result<Self> {
        ensure!(
            Path::new(OF_THE_PROJECT).is_file(),
            "--docs: no {OF_THE_PROJECT} here; run it from the root of the project"
        );
        Ok(Self {
            folder: TRACKED.into(),
            readme: Some(README.into()),
        })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The README that quotes these documents; `None` unless they are the tracked ones.
    pub fn readme(&self) -> Option<&Path> {
        self.readme.as_deref()
    }

    /// The folder `figures/` or one below it, created if missing.
    ///
    /// # Errors
    /// A folder that cannot be created.
    pub fn figures(&self, chapter: &str) -> anyhow::Result<PathBuf> {
        let folder = self.folder.join("figures").join(chapter);
        make(&folder)?;
        Ok(folder)
    }

    /// Writes a document and returns its path.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, name: &str, text: &str) -> anyhow::Result<PathBuf> {
        let path = self.folder.join(name);
        hwall_files::write(&path, text).with_context(|| path.display().to_string())?;
        Ok(path)
    }
}

/// Prints the text of a document, and where it was written.
///
/// # Errors
/// Standard output that cannot be written.
pub fn show(text: impl Display, path: &Path) -> anyhow::Result<()> {
    writeln!(io::stdout(), "{text}\nwrote {}", path.display()).context("standard output")
}

/// A bar of progress on standard error, if that is a terminal.
pub fn bar(template: &str, length: u64) -> ProgressBar {
    let style = ProgressStyle::with_template(template);
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style)
}

/// The sentence in a document about the command that wrote it: the running program.
pub fn written_by() -> String {
    let program = std::env::current_exe().unwrap_or_default();
    let name = program.file_stem().unwrap_or_default().to_string_lossy();
    let words: Vec<String> = std::env::args().skip(1).collect();
    sentence_about(&name, &words)
}

fn sentence_about(program: &str, words: &[String]) -> String {
    let mut command = format!("cargo run --release --example {program}");
    if !words.is_empty() {
        command += " --";
    }
    for word in words {
        command += " ";
        command += &quoted(&without_place(word));
    }
    format!("Written by `{command}`; not edited by hand.")
}

/// A word of a command line, without machine-specific paths.
fn without_place(word: &str) -> String {
    let (flag, value) = match word.split_once('=') {
        Some((flag, value)) if flag.starts_with("--") => (format!("{flag}="), value),
        _ => (String::new(), word),
    };
    let path = Path::new(value);
    match path.file_name() {
        Some(name) if path.is_absolute() => format!("{flag}{}", name.to_string_lossy()),
        _ => word.to_owned(),
    }
}

/// A word quoted for a shell.
pub fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-,:=+".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

fn make(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())
}

/// Replaces the text between the markers `<!-- NAME:begin -->` and `<!-- NAME:end -->` of a file.
///
/// # Errors
/// A file that cannot be read or written, or one without the markers.
pub fn renew_block(file: &Path, name: &str, text: &str) -> anyhow::Result<()> {
    renew_words(file, name, &format!("\n{text}"))
}

/// As [`renew_block`], within a line: only `text` is put between the markers.
///
/// # Errors
/// A file that cannot be read or written, or one without the markers.
pub fn renew_words(file: &Path, name: &str, text: &str) -> anyhow::Result<()> {
    let context = || file.display().to_string();
    let (begin, end) = (
        format!("<!-- {name}:begin -->"),
        format!("<!-- {name}:end -->"),
    );
    let old = std::fs::read_to_string(file).with_context(context)?;
    let marked = || format!("{} has no {begin} and {end}", file.display());
    let (before, rest) = old.split_once(&begin).with_context(marked)?;
    let (_, after) = rest.split_once(&end).with_context(marked)?;
    hwall_files::write(file, format!("{before}{begin}{text}{end}{after}")).with_context(context)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        destination: Destination,
    }

    fn opened(words: &[&str], default: &Path) -> anyhow::Result<Documents> {
        let line = Line::try_parse_from([&["program"], words].concat())?;
        line.destination.open(default)
    }

    fn scratch(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("hwall_documents_{}", std::process::id()));
        folder.join(name)
    }

    #[test]
    fn nothing_tracked_is_written_unless_asked_for() {
        let default = scratch("default");
        let documents = opened(&[], &default).unwrap();
        assert_eq!((documents.folder(), documents.readme()), (&*default, None));
        let chosen = scratch("chosen");
        let documents = opened(&["--out", chosen.to_str().unwrap()], &default).unwrap();
        assert_eq!((documents.folder(), documents.readme()), (&*chosen, None));
        assert!(documents.figures("a").unwrap().is_dir());
        assert!(opened(&["--docs", "--out", "x"], &default).is_err());
        // Tests run in the folder of their package, which is not the root.
        let error = opened(&["--docs"], &default).unwrap_err().to_string();
        assert!(error.contains("root of the project"), "{error}");
    }

    /// Regression: some documents named their program without its flags.
    #[test]
    fn a_document_names_the_command_that_wrote_it() {
        let words = ["--docs", "--touches", "1200", "--hand", "my hand.csv"].map(String::from);
        let said = sentence_about("in_time", &words);
        let command =
            "`cargo run --release --example in_time -- --docs --touches 1200 --hand 'my hand.csv'`";
        assert_eq!(said, format!("Written by {command}; not edited by hand."));
        let said = sentence_about("in_time", &[]);
        assert!(said.contains("--example in_time`;"), "{said}");
        assert!(written_by().starts_with("Written by `cargo run"));
        // Machine-specific paths are removed.
        let here = std::env::temp_dir().join("my scene.obj");
        let words = ["", "--in="].map(|flag| format!("{flag}{}", here.display()));
        let said = sentence_about("in_time", &words);
        let named = "-- 'my scene.obj' '--in=my scene.obj'`";
        assert!(said.contains(named), "{said}");
    }

    #[test]
    fn a_block_is_replaced_between_its_markers() {
        let documents = Documents::in_folder(scratch("block")).unwrap();
        let text = "a\n<!-- x:begin -->\nold\n<!-- x:end -->\nb\n";
        let file = documents.write("README.md", text).unwrap();
        renew_block(&file, "x", "new\n").unwrap();
        let renewed = std::fs::read_to_string(&file).unwrap();
        assert_eq!(renewed, text.replace("old", "new"));
        assert!(renew_block(&file, "y", "new\n").is_err());
        let row = "| <!-- x:begin -->old<!-- x:end --> |\n";
        let file = documents.write("row.md", row).unwrap();
        renew_words(&file, "x", "new").unwrap();
        let renewed = std::fs::read_to_string(&file).unwrap();
        assert_eq!(renewed, row.replace("old", "new"));
    }
}

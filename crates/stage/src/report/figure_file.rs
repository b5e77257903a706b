//! A figure file that appears only when complete.

use anyhow::Context;
use hwall_files::Beside;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Path for drawing a figure; the figure gets its name at [`finish`](Self::finish).
///
/// An abandoned drawing writes its content when dropped, so create this first: it is then removed last.
#[derive(Debug)]
pub(super) struct FigureFile {
    /// `None` once renamed; drawing areas borrow the path until then.
    beside: RefCell<Option<Beside>>,
    path: PathBuf,
    target: PathBuf,
}

impl FigureFile {
    /// Begins a figure.
    ///
    /// # Errors
    /// A file that cannot be created.
    pub(super) fn create(path: &Path) -> anyhow::Result<Self> {
        let beside = Beside::new(path).with_context(|| path.display().to_string())?;
        Ok(Self {
            path: beside.path().to_owned(),
            beside: RefCell::new(Some(beside)),
            target: path.to_owned(),
        })
    }

    /// Path for drawing.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the figure its name.
    ///
    /// # Errors
    /// A full disk, a file that cannot be renamed.
    pub(super) fn finish(&self) -> anyhow::Result<()> {
        match self.beside.take() {
            Some(beside) => beside.finish(),
            None => Ok(()),
        }
        .with_context(|| self.target.display().to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::prelude::{IntoDrawingArea, SVGBackend, WHITE};

    #[test]
    fn a_figure_that_is_given_up_leaves_the_good_one() {
        let folder = std::env::temp_dir().join(format!("hwall_figure_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("f.svg");
        std::fs::write(&path, "good").unwrap();
        let draw = |fails: bool| -> anyhow::Result<()> {
            let file = FigureFile::create(&path)?;
            let root = SVGBackend::new(file.path(), (10, 10)).into_drawing_area();
            root.fill(&WHITE)?;
            anyhow::ensure!(!fails, "no more");
            root.present()?;
            file.finish()
        };
        assert!(draw(true).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "good");
        draw(false).unwrap();
        assert!(
            std::fs::read_to_string(&path)
                .unwrap()
                .ends_with("</svg>\n")
        );
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    }
}

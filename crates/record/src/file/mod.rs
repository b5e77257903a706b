//! MCAP files: one that is whole after every flush, and the records of one that may be cut anywhere.

mod growing;
mod records;

pub(crate) use growing::{GrowingFile, create_alone};
pub(crate) use records::{MessageAt, read_messages};

/// How a recording ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The recorder was finished.
    Finished,
    /// The file is whole, but nobody finished the recorder: the program ended before it could.
    Unfinished,
    /// The file is cut within a record; what stands before it was read.
    Cut {
        /// Where the cut record begins, bytes from the start of the file.
        offset: u64,
    },
    /// All that was recorded is there; what other programs find their way by, behind it, is cut.
    CutBehind {
        /// Where the cut record begins, bytes from the start of the file.
        offset: u64,
    },
    /// The file goes on behind its end: another program wrote to it as well, or the recorder was killed at the very end. What
    /// stands before was read.
    Followed {
        /// Where what does not belong to it begins, bytes from the start of the file.
        offset: u64,
    },
}

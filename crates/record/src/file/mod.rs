//! MCAP files: one that is complete after every flush, and the records of a file that may be truncated anywhere.

mod growing;
mod records;

pub(crate) use growing::{GrowingFile, create_alone};
pub(crate) use records::{MessageAt, read_messages};

/// How a recording ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The recorder was finished.
    Finished,
    /// The file is complete, but the recorder was not finished: the program ended before that.
    Unfinished,
    /// The file is truncated within a record; everything before it was read.
    Cut {
        /// Start of the truncated record, bytes from the start of the file.
        offset: u64,
    },
    /// All recorded data is complete; the index for other programs, which follows it, is truncated.
    CutBehind {
        /// Start of the truncated record, bytes from the start of the file.
        offset: u64,
    },
    /// The file continues after its end: another program wrote to it as well, or the recorder was killed at the very end. Everything before
    /// that was read.
    Followed {
        /// Start of the foreign bytes, bytes from the start of the file.
        offset: u64,
    },
}

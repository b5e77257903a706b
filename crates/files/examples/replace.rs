//! Replaces a file, then fails halfway through the next version: the complete one stays.

use std::io::{self, Write};

fn main() -> io::Result<()> {
    let path = std::env::temp_dir().join("hwall-files-example.csv");
    hwall_files::write(&path, "t,x\n0,1\n")?;
    let failed = || -> io::Result<()> {
        let mut file = hwall_files::NewFile::create(&path)?;
        file.write_all(b"t,x\n0,2\n")?;
        Err(io::Error::other("the second row could not be computed"))
    };
    println!("{}", failed().unwrap_err());
    print!("still whole:\n{}", std::fs::read_to_string(&path)?);
    std::fs::remove_file(&path)
}

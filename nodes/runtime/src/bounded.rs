//! Reading a file that a user names, into no more memory than is sensible.

use std::{fs::File, io, path::Path};

/// Most bytes of a file that are read: some ten million particles as text.
const MOST: u64 = 1 << 30;

/// The contents of a file.
///
/// # Errors
/// It cannot be read, or it is larger than 1 GiB.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    use io::Read as _;
    let too_large = || io::Error::new(io::ErrorKind::FileTooLarge, format!("it is larger than {} MiB", MOST >> 20));
    let file = File::open(path)?;
    if file.metadata()?.len() > MOST {
        return Err(too_large());
    }
    let mut contents = Vec::new();
    // It may grow, and a device says that it is empty.
    let read = file.take(MOST + 1).read_to_end(&mut contents)? as u64;
    if read > MOST { Err(too_large()) } else { Ok(contents) }
}

//! Files that are read as a whole, if they are not too large.

use crate::error::{Error, Result};
use std::io::Read;
use std::path::Path;

/// The bytes of a file of at most `most`, a whole number of MiB: a guard against opening the wrong file. `kind` is what
/// such files are called.
pub(crate) fn read_at_most(path: &Path, most: u64, kind: &str) -> Result<Vec<u8>> {
    let file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    if bytes.len() as u64 > most {
        return Err(Error::content(
            path,
            format!("larger than {} MiB, the most that a {kind} file may have", most >> 20),
        ));
    }
    Ok(bytes)
}

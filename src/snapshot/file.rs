//! Snapshots as files: a mark, a version, lengths, a header in JSON, the particles' bytes, and a checksum over all of
//! it.

use super::{Particles, Snapshot, SnapshotFault};
use crate::error::{Error, Result};
use crate::load;
use crate::report::Counts;
use crate::scene::to_json;
use crate::sensor;
use crate::timeline::clock::Clock;
use crate::world::World;
use serde_json::Value;
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// How a file begins.
const MARK: [u8; 8] = *b"pbmpm\0\x1a\n";
/// Of the format.
const VERSION: u32 = 10;
/// Mark, version, and the lengths of header and particles.
const FRONT: usize = 8 + 4 + 8 + 8;
/// The checksum.
const BACK: usize = 4;

/// All but the particles.
#[derive(serde::Serialize, serde::Deserialize)]
struct Header {
    /// The world as a scene, without what does not affect a run.
    world: Value,
    /// CRC-32 of the distances of its meshes, which a scene may only name.
    distances: Vec<u32>,
    clock: Clock,
    counts: Counts,
    loads: Vec<[(i64, u64); load::SUMS]>,
    sensed: Vec<[i64; sensor::SUMS]>,
    width: u32,
    stored: u32,
    words: u32,
    lanes: u32,
}

impl Snapshot {
    /// The contents of a file.
    ///
    /// # Errors
    /// [`Error::Snapshot`] if a number in it cannot be written.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let Particles { width, stored, words, lanes, ref bytes } = self.particles;
        let header = Header {
            world: scene(&self.world),
            distances: distances(&self.world),
            clock: self.clock.clone(),
            counts: self.counts,
            loads: self.loads.clone(),
            sensed: self.sensed.clone(),
            width,
            stored,
            words,
            lanes,
        };
        let header = serde_json::to_vec(&header).map_err(|e| SnapshotFault::Content(e.to_string()).in_memory())?;
        let mut out = Vec::with_capacity(FRONT + header.len() + bytes.len() + BACK);
        out.extend_from_slice(&MARK);
        out.extend_from_slice(&VERSION.to_le_bytes());
        out.extend_from_slice(&(header.len() as u64).to_le_bytes());
        out.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
        out.extend_from_slice(&header);
        out.extend_from_slice(bytes);
        out.extend_from_slice(&crc32fast::hash(&out).to_le_bytes());
        Ok(out)
    }

    /// From the contents of a file, for solvers of `world`.
    ///
    /// # Errors
    /// [`Error::Snapshot`] with what is wrong: not a snapshot, of another version, truncated, altered, or of another
    /// world.
    pub fn from_bytes(bytes: &[u8], world: &World) -> Result<Self> {
        let header = header_length(bytes, bytes.len() as u64)?;
        let (all, sum) = bytes.split_at(bytes.len() - BACK);
        let expected = u32::from_le_bytes(std::array::from_fn(|i| sum[i]));
        let found = crc32fast::hash(all);
        if found != expected {
            return Err(SnapshotFault::Altered { found, expected }.in_memory());
        }
        let (header, particles) = all[FRONT..].split_at(header);
        let header: Header =
            serde_json::from_slice(header).map_err(|e| SnapshotFault::Content(e.to_string()).in_memory())?;
        let differing = difference("", &header.world, &scene(world));
        let differing = differing.or_else(|| (header.distances != distances(world)).then(|| "meshes".to_owned()));
        if let Some(field) = differing {
            return Err(SnapshotFault::World { field }.in_memory());
        }
        let Header { mut clock, counts, loads, sensed, width, stored, words, lanes, .. } = header;
        clock.build_edits(world)?;
        let particles = Particles { width, stored, words, lanes, bytes: particles.to_vec() };
        Ok(Snapshot { world: Arc::new(world.clone()), clock, counts, loads, sensed, particles })
    }

    /// Writes it to a file, whole or not at all: what was there before stays until all of it is on the disk.
    ///
    /// # Errors
    /// [`Error::Io`] in the operating system's words.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let bytes = self.to_bytes().map_err(|e| e.in_file(path))?;
        write_whole(path, &bytes).map_err(|e| Error::io(path, e))
    }

    /// Reads a file, for solvers of `world`.
    ///
    /// # Errors
    /// [`Error::Io`] for a file that cannot be read; otherwise as [`from_bytes`](Self::from_bytes).
    pub fn read(path: impl AsRef<Path>, world: &World) -> Result<Self> {
        let path = path.as_ref();
        let io = |e| Error::io(path, e);
        let file = File::open(path).map_err(io)?;
        let mut bytes = Vec::new();
        (&file).take(FRONT as u64).read_to_end(&mut bytes).map_err(io)?;
        // Of a file that is no snapshot, however large, only the beginning is read. Pipes do not know their length.
        let [_, expected] = lengths(&bytes, bytes.len() as u64).map_err(|e| e.in_file(path))?;
        let metadata = file.metadata().map_err(io)?;
        if metadata.is_file() {
            header_length(&bytes, metadata.len()).map_err(|e| e.in_file(path))?;
        }
        // With one byte more, which would tell that it is too long.
        file.take(expected.saturating_sub(FRONT as u64).saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
        Snapshot::from_bytes(&bytes, world).map_err(|e| e.in_file(path))
    }
}

/// The lengths of the header and of all, by how a snapshot begins of which `found` bytes are known; an error for what
/// can be none.
fn lengths(bytes: &[u8], found: u64) -> Result<[u64; 2]> {
    if !bytes.starts_with(&MARK[..bytes.len().min(MARK.len())]) {
        return Err(SnapshotFault::NotASnapshot.in_memory());
    }
    let Some(front) = bytes.get(..FRONT) else {
        return Err(SnapshotFault::Length { found, expected: (FRONT + BACK) as u64 }.in_memory());
    };
    let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| front[at + i]));
    let version = number(8) as u32;
    if version != VERSION {
        return Err(SnapshotFault::Version { found: version, known: VERSION }.in_memory());
    }
    let (header, particles) = (number(12), number(20));
    Ok([header, header.saturating_add(particles).saturating_add((FRONT + BACK) as u64)])
}

/// The length of the header, by how a snapshot of `found` bytes begins; an error for what can be none.
fn header_length(bytes: &[u8], found: u64) -> Result<usize> {
    let [header, expected] = lengths(bytes, found)?;
    if expected != found {
        return Err(SnapshotFault::Length { found, expected }.in_memory());
    }
    Ok(header as usize)
}

impl Error {
    /// The same of a snapshot that lies in a file.
    fn in_file(self, path: &Path) -> Self {
        match self {
            Error::Snapshot { fault, .. } => Error::Snapshot { path: path.display().to_string(), fault },
            other => other,
        }
    }
}

/// The most links that are followed, one after the other.
const MOST_LINKS: u32 = 40;

/// Replaces a file by one with these bytes, which is first written beside it.
fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    // Through links the file that they lead to is replaced, or made, not the link.
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(to) = path.read_link() else { break };
        path.pop();
        path.push(to);
    }
    let path = &path;
    // Devices and pipes are written to: to replace them would take them from everybody else.
    if path.metadata().is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        return File::options().write(true).open(path)?.write_all(bytes);
    }
    let (beside, mut file) = begin_beside(path)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all()).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        // The first failure is reported; one to remove the remainder is not.
        let _ = std::fs::remove_file(&beside);
    }
    written
}

/// A new file beside `path`, with a name that no other writer has, in this process or another.
fn begin_beside(path: &Path) -> std::io::Result<(PathBuf, File)> {
    static BEGUN: AtomicU64 = AtomicU64::new(0);
    loop {
        let mut name = path.file_name().ok_or(ErrorKind::InvalidFilename)?.to_owned();
        name.push(format!(".{}.{}.part", std::process::id(), BEGUN.fetch_add(1, Ordering::Relaxed)));
        let beside = path.with_file_name(name);
        match File::create_new(&beside) {
            // Left by a process that was ended.
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            created => return created.map(|file| (beside, file)),
        }
    }
}

/// What of a world affects a run.
fn scene(world: &World) -> Value {
    let world = World { name: String::new(), camera: None, ..world.clone() };
    serde_json::from_str(&to_json(&world)).unwrap_or_default()
}

fn distances(world: &World) -> Vec<u32> {
    let sum = |values: &[f32]| crc32fast::hash(bytemuck::cast_slice(values));
    world.distance_grids().map(|grid| sum(&grid.values)).collect()
}

/// The path of the first place in which two documents differ.
fn difference(path: &str, a: &Value, b: &Value) -> Option<String> {
    let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            let none = &Value::Null;
            let keys = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key)));
            keys.map(|key| (key, a.get(key).unwrap_or(none), b.get(key).unwrap_or(none)))
                .find_map(|(key, a, b)| difference(&below(key), a, b))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().find_map(|(i, (a, b))| difference(&format!("{path}[{i}]"), a, b))
        }
        _ => (a != b).then(|| path.to_owned()),
    }
}

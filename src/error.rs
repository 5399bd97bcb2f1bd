//! Errors of calls, for the caller to handle. What goes wrong *inside* a step is data instead: see
//! [`Faults`](crate::Faults).

use std::path::Path;

/// An error of this crate. Every variant says what was wrong and what would be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A field of a world, of the settings or of a call has a value that is not allowed.
    #[error("{field} = {value}: must be {allowed}")]
    Invalid {
        /// Path of the field, for example `colliders[3].shape.half_size`.
        field: String,
        /// The value found.
        value: String,
        /// What is allowed there.
        allowed: String,
    },
    /// A scene file is not valid JSON, or does not have the documented form.
    #[error("scene {path}: {message}")]
    Scene {
        /// Where in the document, for example `materials[0].relaxation`, or the file's name.
        path: String,
        /// The parser's or the validator's words, with the value found and what is allowed.
        message: String,
    },
    /// A file could not be read or written, or is not what it should be.
    #[error("{path}: {message}")]
    Io {
        /// The file.
        path: String,
        /// What kind of failure it is, for example [`NotFound`](std::io::ErrorKind::NotFound); for a file that could be
        /// read but is not of its format [`InvalidData`](std::io::ErrorKind::InvalidData).
        kind: std::io::ErrorKind,
        /// The operating system's words, or what is wrong with the content.
        message: String,
    },
    /// A snapshot cannot be resumed, or could not be taken.
    #[error("snapshot {path}: {fault}")]
    Snapshot {
        /// The file, or `in memory`.
        path: String,
        /// What is wrong.
        fault: crate::SnapshotFault,
    },
    /// The device lacks a limit or feature that this world needs.
    #[error("the device's {what} is {available}, this world needs {needed}: {remedy}")]
    Unsupported {
        /// The limit or feature.
        what: &'static str,
        /// What the device has.
        available: u64,
        /// What is needed.
        needed: u64,
        /// What to change.
        remedy: &'static str,
    },
    /// More steps were recorded than the constants ring holds before the device finished the oldest.
    #[error(
        "{max} steps are recorded and not finished: submit and poll the device, or raise GpuOptions::steps_in_flight"
    )]
    StepsInFlight {
        /// The ring's size, [`GpuOptions::steps_in_flight`](crate::GpuOptions::steps_in_flight).
        max: u32,
    },
    /// Steps were recorded into an encoder that had not been submitted when a report recorded after them was taken: the
    /// solver's clock and bodies have made them, the matter has not, or in another order. Returned with each report
    /// from then on, until the solver has [restored](crate::GpuSolver::restore) a snapshot. Steps alone that are
    /// submitted out of order are not noticed.
    #[error(
        "{lost} recorded steps never reached the device: submit every encoder in order of recording; restore a snapshot"
    )]
    StepsLost {
        /// How many.
        lost: u64,
    },
    /// No adapter was found, or it refused to open a device.
    #[error("no usable graphics adapter: {0}")]
    NoAdapter(String),
    /// The device stopped answering or was lost.
    #[error("graphics device: {0}")]
    Device(String),
}

impl Error {
    /// A file that could not be read or written.
    pub(crate) fn io(path: &Path, error: std::io::Error) -> Self {
        Error::Io { path: path.display().to_string(), kind: error.kind(), message: error.to_string() }
    }

    /// A file that is not what it should be.
    pub(crate) fn content(path: &Path, message: impl ToString) -> Self {
        let kind = std::io::ErrorKind::InvalidData;
        Error::Io { path: path.display().to_string(), kind, message: message.to_string() }
    }
}

/// The crate's result type.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Collects the checks of one value so that all of them read alike.
pub(crate) struct Check<'a> {
    /// Path of the value that is being checked, empty at the top.
    pub path: &'a str,
}

impl Check<'_> {
    /// Path of a field of the value, or of the value itself.
    pub fn field(&self, name: &str) -> String {
        match (self.path.is_empty(), name.is_empty()) {
            (true, _) => name.to_owned(),
            (false, true) => self.path.to_owned(),
            (false, false) => format!("{}.{}", self.path, name),
        }
    }

    /// Fails unless `ok`.
    pub fn that(&self, ok: bool, name: &str, value: impl std::fmt::Debug, allowed: &str) -> Result<()> {
        if ok {
            return Ok(());
        }
        Err(Error::Invalid { field: self.field(name), value: format!("{value:?}"), allowed: allowed.to_owned() })
    }

    /// Fails unless `value` is finite and inside `range`, whose text form is `allowed`.
    pub fn range(&self, name: &str, value: f64, lo: f64, hi: f64, allowed: &str) -> Result<()> {
        self.that(value.is_finite() && value >= lo && value <= hi, name, value, allowed)
    }

    /// Fails unless every component is finite and at most `limit` in size.
    pub fn vector(&self, name: &str, value: glam::DVec3, limit: f64, allowed: &str) -> Result<()> {
        self.that(value.is_finite() && value.abs().max_element() <= limit, name, value.to_array(), allowed)
    }
}

//! Rows in CSV files.

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

pub type Failure = Box<dyn std::error::Error>;

pub fn write<Row: Serialize>(path: &Path, rows: &[Row]) -> Result<(), Failure> {
    let mut writer = csv::Writer::from_path(path)?;
    rows.iter().try_for_each(|row| writer.serialize(row))?;
    Ok(writer.flush()?)
}

pub fn read<Row: DeserializeOwned>(path: &Path) -> Result<Vec<Row>, Failure> {
    let named = |e: csv::Error| format!("{}: {e}", path.display());
    let mut reader = csv::Reader::from_path(path).map_err(named)?;
    Ok(reader.deserialize().collect::<Result<_, _>>().map_err(named)?)
}

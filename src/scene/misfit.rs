//! What the reader says of a document that does not fit, in terms of JSON and with the place.

use super::TOP;
use crate::error::Error;

/// The place and what is wrong there.
pub(super) fn located(error: &serde_path_to_error::Error<serde_json::Error>) -> Error {
    let path = error.path().to_string();
    // `.` is the top and `?` a key that was not read yet.
    let path = Some(path.trim_end_matches(['.', '?'])).filter(|p| !p.is_empty()).unwrap_or(TOP);
    Error::Scene { path: path.to_owned(), message: plain(&error.inner().to_string()) }
}

/// The reader's message, in terms of JSON.
fn plain(message: &str) -> String {
    const NAMED: &str = "a name alone, expected an object with that name as its key";
    let message = message.replace("unit variant, expected struct variant", &format!("{NAMED}: {{\"name\": {{}}}}"));
    // What follows is the name of a type of this crate, and perhaps how many fields it has.
    let message = match message.split_once("expected struct ") {
        Some((before, name)) => {
            let rest = name.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_');
            let rest = if rest.starts_with(" with ") { rest.find(" at ").map_or("", |at| &rest[at..]) } else { rest };
            format!("{before}expected an object{rest}")
        }
        None => message,
    };
    message
        .replace("unit variant, expected newtype variant", NAMED)
        .replace("type: map, expected unit", "type: an object, expected the name alone, in quotes")
        .replace("value: map, expected map with a single key", "value: an object, expected one with a single key")
        .replace("type: map", "type: an object")
        .replace("type: sequence", "type: an array")
        .replace("or map", "or an object")
        .replace("expected a sequence of 3 f64 values", "expected an array of 3 numbers")
        .replace("expected a sequence", "expected an array")
        .replace("expected value at", "expected a JSON value (there are no comments) at")
        .replace("expected f64", "expected a finite number")
        .replace("expected u32", "expected a whole number from 0 to 4294967295")
        .replace("expected u64", "expected a whole number from 0 to 18446744073709551615")
}

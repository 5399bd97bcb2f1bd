//! Scene files: a [`World`] as JSON, read with errors that name the place in the document, and the JSON Schema of the
//! format. `docs/scene-format.md` describes every field.

pub mod lewin;
mod misfit;
mod stated;

use crate::error::{Error, Result};
use crate::files::read_at_most;
use crate::quality::Quality;
use crate::world::World;
use misfit::located;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserialize, DeserializeSeed, Deserializer, IgnoredAny, IntoDeserializer, MapAccess, Visitor};
use serde_json::Value;
use stated::{CHOSEN, Stated};
use std::path::Path;

/// The largest scene file that is read, bytes: a guard against opening the wrong file.
pub const MAX_FILE_BYTES: u64 = 16 << 20;

/// Editors may begin a UTF-8 file with this; JSON may not.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Stands for the top of the document in [`Error::Scene`].
const TOP: &str = "document";

/// Reads and checks a world.
///
/// Unknown fields are refused, so that a misspelt one is not silently a default. A top-level `"$schema"` is allowed and
/// ignored: editors use it to find the schema. Shapes cannot be files; see [`from_json_in`].
///
/// # Errors
/// [`Error::Scene`] where the text is not JSON or not of the documented form, with line and column;
/// [`Error::Invalid`] where a value is out of its range.
pub fn from_json(text: &str) -> Result<World> {
    complete(parse(text)?, None)
}

/// Reads and checks a world whose shapes may be files in `folder`.
///
/// # Errors
/// As [`from_json`]; [`Error::Scene`] also for a file of a shape that cannot be read, or is not of the format that its
/// extension says.
pub fn from_json_in(text: &str, folder: &Path) -> Result<World> {
    complete(parse(text)?, Some(folder))
}

/// Builds the meshes, settles the settings and checks everything.
fn complete(Document(mut world, stated): Document, folder: Option<&Path>) -> Result<World> {
    // Distance grids depend on the domain, which has to be valid first.
    world.domain.validate("domain")?;
    world.build_meshes(folder)?;
    stated.settle(&mut world);
    world.validate()?;
    Ok(world)
}

fn parse(text: &str) -> Result<Document> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let document = serde_path_to_error::deserialize(&mut reader).map_err(|e| match located(&e) {
        // The reader reports some misfits in valid JSON as broken JSON; the message for the parsed value is clearer.
        Error::Scene { path, message } if e.inner().is_syntax() => Error::Scene {
            message: match serde_json::from_str(text).map(parse_value) {
                Ok(Err(Error::Scene { path: same, message })) if same == path => {
                    format!("{message} at line {} column {}", e.inner().line(), e.inner().column())
                }
                _ => message,
            },
            path,
        },
        error => error,
    })?;
    reader.end().map_err(|e| Error::Scene { path: TOP.to_owned(), message: e.to_string() })?;
    Ok(document)
}

/// Reads and checks a world from parsed JSON, for example after [`apply_override`].
///
/// # Errors
/// As [`from_json`], without line and column.
pub fn from_value(document: Value) -> Result<World> {
    complete(parse_value(document)?, None)
}

/// [`from_value`] of a world whose shapes may be files in `folder`.
///
/// # Errors
/// As [`from_json_in`], without line and column.
pub fn from_value_in(document: Value, folder: &Path) -> Result<World> {
    complete(parse_value(document)?, Some(folder))
}

fn parse_value(document: Value) -> Result<Document> {
    serde_path_to_error::deserialize(document).map_err(|e| located(&e))
}

/// Reads and checks the world in a file of at most [`MAX_FILE_BYTES`]. Its shapes may be files in its folder.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be read, is too large or is not UTF-8; otherwise as [`from_json_in`].
pub fn from_file(path: impl AsRef<Path>) -> Result<World> {
    let path = path.as_ref();
    from_json_in(&read_text(path)?, folder_of(path))
}

/// The folder of a scene file, for [`from_json_in`] and [`from_value_in`].
pub fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// Reads the text of a scene file, without a byte order mark, for callers that change the document before
/// [`from_value`].
///
/// # Errors
/// [`Error::Io`] as for [`from_file`].
pub fn read_text(path: &Path) -> Result<String> {
    let mut bytes = read_at_most(path, MAX_FILE_BYTES, "scene")?;
    if bytes.starts_with(BYTE_ORDER_MARK) {
        bytes.drain(..BYTE_ORDER_MARK.len());
    }
    String::from_utf8(bytes).map_err(|e| Error::content(path, e))
}

/// Writes a world as indented JSON with every field; [`from_json`] gives back the same world, bit for bit, as long as
/// all its numbers are finite ([`from_json_in`] where a shape is a file).
pub fn to_json(world: &World) -> String {
    #[expect(clippy::expect_used, reason = "plain data with string keys always serialises")]
    serde_json::to_string_pretty(world).expect("a world has string keys only and no failing serializer")
}

/// The JSON Schema (draft 2020-12) of a scene file, indented. It is kept as `docs/scene.schema.json`.
pub fn schema() -> String {
    let mut schema = schemars::schema_for!(World).to_value();
    schema["title"] = "pbmpm scene".into();
    let mut quality = schemars::schema_for!(Quality).to_value();
    let settings = &mut schema["$defs"]["Settings"]["properties"];
    for chosen in CHOSEN {
        settings[chosen].as_object_mut().into_iter().for_each(|object| drop(object.remove("default")));
    }
    let [others @ .., last] = CHOSEN;
    let description = format!("Chooses {} and {last}, but those that are given.", others.join(", "));
    settings["quality"] =
        serde_json::json!({ "$ref": "#/$defs/Quality", "description": description, "default": "realtime" });
    quality.as_object_mut().into_iter().for_each(|object| drop(object.remove("$schema")));
    schema["$defs"]["Quality"] = quality;
    schema["properties"]["$schema"] = serde_json::json!({ "type": "string", "description": "For editors; ignored." });
    for (name, definition) in schema["$defs"].as_object_mut().into_iter().flatten() {
        definition["title"] = name.as_str().into();
    }
    tidy(&mut schema, "");
    #[expect(clippy::expect_used, reason = "plain data with string keys always serialises")]
    let mut text = serde_json::to_string_pretty(&schema).expect("a JSON value can be written");
    text.push('\n');
    text
}

/// Makes the types' documentation plain text, without links into the crate, and writes `f32` defaults as they were.
fn tidy(value: &mut Value, key: &str) {
    match value {
        Value::Object(map) => map.iter_mut().for_each(|(key, value)| tidy(value, key)),
        Value::Array(items) => items.iter_mut().for_each(|item| tidy(item, key)),
        Value::String(text) if key == "description" => {
            let mut pieces = text.split("](crate::");
            let mut plain = pieces.next().unwrap_or_default().to_owned();
            plain.extend(pieces.map(|piece| piece.split_once(')').map_or(piece, |(_, rest)| rest)));
            let paragraphs: Vec<_> = plain.split("\n\n").map(|p| p.replace('\n', " ")).collect();
            *text = paragraphs.join("\n\n").replace("[`", "`").replace("`]", "`");
        }
        Value::Number(number) if number.as_f64().is_some_and(|x| x.fract() != 0.0 && x == f64::from(x as f32)) => {
            let short = number.as_f64().and_then(|x| (x as f32).to_string().parse::<f64>().ok());
            *value = short.map_or(Value::Null, Value::from);
        }
        _ => {}
    }
}

/// Sets one place of a document: `settings.dt=0.01`, `spawns[1].fill={"per_cell":27}`, `materials[0].name=oil`.
///
/// The text after the first `=` is read as JSON; if it is not JSON, it is taken as a string. Missing keys are created
/// ([`from_value`] refuses those that the format does not know), array elements are not. `settings.quality` replaces
/// all settings that it chooses. The document is unchanged after an error.
///
/// # Errors
/// [`Error::Scene`] with the path up to the element that does not fit, [`Error::Invalid`] for a number that is too
/// large for one.
pub fn apply_override(document: &mut Value, assignment: &str) -> Result<()> {
    let fail = |path: &str, message: String| Err(Error::Scene { path: path.to_owned(), message });
    let Some((path, text)) = assignment.split_once('=') else {
        return fail(assignment, "no `=`: an override is written path=value, as in settings.dt=0.01".to_owned());
    };
    let mut changed = document.clone();
    let mut place = &mut changed;
    let mut walked = String::new();
    for step in path.trim().replace('[', ".[").split('.') {
        let parent = if walked.is_empty() { TOP.to_owned() } else { walked.clone() };
        walked += if walked.is_empty() || step.starts_with('[') { "" } else { "." };
        walked += step;
        let index = step.strip_prefix('[').map(|s| s.strip_suffix(']').and_then(|s| s.parse::<usize>().ok()));
        if place.is_null() && index.is_none() {
            *place = Value::Object(serde_json::Map::new());
        }
        place = match (index, place) {
            (Some(None), _) => return fail(&walked, format!("`{step}` is no index, as in materials[0]")),
            (Some(Some(i)), Value::Array(items)) => match (items.len(), items.get_mut(i)) {
                (_, Some(item)) => item,
                (n, None) => return fail(&walked, format!("no such element: there are {n}, counted from 0")),
            },
            (Some(_), found) => return fail(&parent, format!("has no elements, it is {found}")),
            (None, _) if step.is_empty() => return fail(assignment, "empty field name in the path".to_owned()),
            (None, Value::Object(fields)) => fields.entry(step).or_insert(Value::Null),
            (None, found) => return fail(&parent, format!("has no field `{step}`, it is {found}")),
        };
    }
    let text = text.trim();
    // A name may be anything, but this was meant as a number.
    let numeral = text.starts_with(|c: char| c.is_ascii_digit() || c == '-');
    let too_large = numeral && text.parse().is_ok_and(|x: f64| !x.is_finite());
    if too_large {
        let (field, value) = (walked, text.to_owned());
        return Err(Error::Invalid { field, value, allowed: "a finite number, less than 1.8e308 in size".to_owned() });
    }
    *place = serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.to_owned()));
    if walked == "settings.quality"
        && let Some(settings) = changed["settings"].as_object_mut()
    {
        settings.retain(|field, _| !CHOSEN.contains(&field.as_str()));
    }
    *document = changed;
    Ok(())
}

/// A world without its settings, and the settings that are stated. Next to the fields there may be a `"$schema"`.
struct Document(World, Stated);

impl<'de> Deserialize<'de> for Document {
    fn deserialize<D: Deserializer<'de>>(reader: D) -> Result<Self, D::Error> {
        struct Fields;
        impl<'de> Visitor<'de> for Fields {
            type Value = Document;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a scene, which is an object")
            }
            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Document, M::Error> {
                let mut stated = None;
                let world = World::deserialize(MapAccessDeserializer::new(Aside { map, stated: &mut stated }))?;
                Ok(Document(world, stated.unwrap_or_default()))
            }
        }
        reader.deserialize_map(Fields)
    }
}

/// The entries of a map except that of the schema, and of the settings, which are put aside. Unlike a detour over
/// [`Value`] this keeps line, column and the refusal of duplicate fields.
struct Aside<'a, M> {
    map: M,
    stated: &'a mut Option<Stated>,
}

impl<'de, M: MapAccess<'de>> MapAccess<'de> for Aside<'_, M> {
    type Error = M::Error;
    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, M::Error> {
        let mut seed = Some(seed);
        while let Some(found) = self.map.next_key_seed(Key(&mut seed))? {
            match found {
                Found::Field(field) => return Ok(Some(field)),
                Found::Schema => drop(self.map.next_value::<IgnoredAny>()?),
                Found::Settings if self.stated.is_some() => return Err(de::Error::duplicate_field(SETTINGS)),
                Found::Settings => *self.stated = Some(self.map.next_value()?),
            }
        }
        Ok(None)
    }
    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, M::Error> {
        self.map.next_value_seed(seed)
    }
}

const SETTINGS: &str = "settings";

/// A key.
enum Found<F> {
    Field(F),
    Settings,
    Schema,
}

/// Reads a key with the seed, or leaves the seed for those that are put aside.
struct Key<'a, K>(&'a mut Option<K>);

impl<'de, K: DeserializeSeed<'de>> DeserializeSeed<'de> for Key<'_, K> {
    type Value = Found<K::Value>;
    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<Self::Value, D::Error> {
        let key = String::deserialize(reader)?;
        match self.0.take_if(|_| key != SETTINGS && key != "$schema") {
            Some(seed) => seed.deserialize(key.into_deserializer()).map(Found::Field),
            None if key == SETTINGS => Ok(Found::Settings),
            None => Ok(Found::Schema),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"{
        "$schema": "../docs/scene.schema.json",
        "domain": { "min": [0, 0, 0], "max": [1, 2, 1], "cell_size": 0.1, "walls": { "y_max": "open" } },
        "materials": [{ "name": "water", "color": [0.1, 0.2, 0.3] }],
        "spawns": [{ "material": "water", "shape": { "sphere": { "radius": 0.3 } }, "position": [0.5, 1, 0.5],
                     "fill": { "spacing": 0.05 } }],
        "colliders": [{ "shape": "half_space", "position": [0, 0.1, 0], "boundary": { "friction": 0.3 } },
                      { "shape": { "box": { "half_size": [3, 4, 5] } }, "position": [0, 0, 0] }]
    }"#;

    #[test]
    fn round_trip_keeps_every_bit() {
        let mut world = from_json(SCENE).unwrap();
        (world.settings.dt, world.gravity.x) = (1.0 / 30.0, f64::MIN_POSITIVE);
        assert_eq!(from_json(&to_json(&world)).unwrap(), world);
    }

    #[test]
    fn errors_name_the_place_and_what_is_allowed() {
        for (from, to, path, text) in [
            ("\"cell_size\"", "\"cellsize\"", "domain.cellsize", "unknown field `cellsize`, expected one of `min`"),
            ("\"spawns\"", "\"spawn\"", "spawn", "at line 5 column"),
            (
                "[3, 4, 5]",
                "[3, \"x\", 5]",
                "colliders[1].shape.box.half_size[1]",
                "string \"x\", expected a finite number",
            ),
            ("[3, 4, 5]", "[3, 4, 5, 6]", "colliders[1].shape.box.half_size", "invalid length 4"),
            (
                "{ \"spacing\": 0.05 }",
                "7",
                "spawns[0].fill",
                "integer `7`, expected string or an object at line 6 column",
            ),
            ("\"open\"", "\"opened\"", "domain.walls.y_max", "expected one of `slip`, `friction`, `stick`, `open`"),
            (", \"cell_size\": 0.1", "", "domain", "missing field `cell_size`"),
            ("\"radius\": 0.3", "\"radius\": 1, \"radius\": 2", "spawns[0].shape.sphere", "duplicate field `radius`"),
            ("0.3 } }, \"p", "-1 } }, \"p", "spawns[0].shape.sphere.radius", "-1.0: must be above 0, at most 1e6 m"),
            ("0.3 } },\n", "11 } },\n", "colliders[0].boundary", "11.0: must be a friction coefficient of 0 to 10"),
            ("[0, 0.1, 0]", "[0, 0.1 0]", "colliders[0].position", "expected `,` or `]` at line 7 column"),
            ("{\n", "[\n", TOP, "expected a scene, which is an object at line 1"),
        ] {
            assert!(SCENE.contains(from), "{from}");
            let error = from_json(&SCENE.replacen(from, to, 1)).expect_err(to);
            let at = matches!(&error, Error::Scene { path: at, .. } | Error::Invalid { field: at, .. } if at == path);
            assert!(at && error.to_string().contains(text), "{error}");
        }
    }

    /// Settings stated beside a quality win; as an override a quality replaces those that it chooses.
    #[test]
    fn a_quality_chooses_what_is_not_given() {
        let with = |settings: &str| {
            let text = SCENE.replacen("\"spawns\"", &format!("\"settings\": {settings}, \"spawns\""), 1);
            from_json(&text).map(|world| world.settings)
        };
        let world = from_json(SCENE).unwrap();
        let unstated = World { settings: crate::Settings::default(), ..world.clone() };
        assert_eq!(world.settings, Quality::Realtime.settings(&unstated));
        assert_eq!(with("{}"), Ok(world.settings.clone()));
        // Sixty cells of liquid need shorter steps where blocks are not to share their pressure.
        let deep = |settings: &str| {
            let fine = SCENE.replacen("\"cell_size\": 0.1", "\"cell_size\": 0.01", 1);
            let text = fine.replacen("\"spawns\"", &format!("\"settings\": {settings}, \"spawns\""), 1);
            from_json(&text).unwrap().settings
        };
        let (shared, apart) = (deep("{}"), deep("{ \"block_pressure\": false }"));
        assert!(shared.block_pressure && !apart.block_pressure);
        assert!((shared.dt / apart.dt - (60.0f64 / 32.0).sqrt()).abs() < 1e-9, "{shared:?} and {apart:?}");
        // Stated steps or iterations, without a quality, decide how stiff liquids are.
        let stated = crate::Settings { bulk_limit: None, ..world.settings.clone() };
        let volume_correction_time = unstated.settings.volume_correction_time;
        let fixed = crate::Settings { dt: 0.002, courant: 0.0, volume_correction_time, ..stated.clone() };
        assert_eq!(with("{ \"dt\": 0.002 }"), Ok(fixed));
        let iterations = crate::Settings { iterations: 9, ..stated };
        assert_eq!(with("{ \"iterations\": 9 }"), Ok(iterations.clone()));
        let limited = crate::Settings { bulk_limit: Some(1e5), ..iterations };
        assert_eq!(with("{ \"iterations\": 9, \"bulk_limit\": 1e5 }"), Ok(limited));
        for quality in [Quality::Draft, Quality::Realtime, Quality::Accurate] {
            let name = serde_json::to_string(&quality).unwrap();
            let chosen = quality.settings(&world);
            assert_eq!(with(&format!("{{ \"quality\": {name} }}")), Ok(chosen.clone()));
            let given =
                with(&format!("{{ \"dt\": 0.002, \"quality\": {name}, \"tension_limit\": 1.5, \"courant\": 0 }}"));
            let bulk_limit = quality.stiffness(crate::Scheme::Implicit, &world, 0.002);
            let expected = crate::Settings { dt: 0.002, tension_limit: 1.5, courant: 0.0, bulk_limit, ..chosen };
            assert_eq!(given, Ok(expected.clone()));
            let published = with(&format!("{{ \"quality\": {name}, \"scheme\": \"published\" }}"));
            assert_eq!(published, Ok(quality.settings_in(crate::Scheme::Published, &world)));
            // Written down as numbers.
            let whole = World { settings: expected, ..world.clone() };
            let text = to_json(&whole);
            assert!(!text.contains("quality"));
            assert_eq!(from_json(&text).as_ref(), Ok(&whole));
            let mut document = serde_json::from_str(&text).unwrap();
            for (set, dt) in [
                ("settings.block_pressure=false".to_owned(), whole.settings.dt),
                (format!("settings.quality={name}"), quality.settings(&world).dt),
                ("settings.dt=0.003".to_owned(), 0.003),
            ] {
                apply_override(&mut document, &set).unwrap();
                let settings = from_value(document.clone()).unwrap().settings;
                assert_eq!((settings.dt, settings.tension_limit), (dt, 1.5));
                let shared = !set.contains("block_pressure") && quality.settings(&world).block_pressure;
                assert_eq!(settings.block_pressure, shared, "{set}");
            }
        }
        for (settings, path, text) in [
            (
                "{ \"quality\": \"best\" }",
                "settings.quality",
                "expected one of `draft`, `realtime`, `accurate` at line 5",
            ),
            ("{ \"quality\": null }", "settings.quality", "at line 5"),
            ("{ \"dt\": null }", "settings.dt", "invalid type: null, expected a finite number at line 5"),
            ("{ \"quality\": \"draft\", \"quality\": \"draft\" }", "settings", "duplicate field `quality`"),
            ("{}, \"settings\": {}", TOP, "duplicate field `settings`"),
            ("{ \"quality\": \"draft\", \"dt\": 1 }", "settings.dt", "must be 1e-5 to 0.2 s"),
            ("{ \"courant\": 0.01 }", "settings.courant", "must be 0, or 0.05 to 16 cells"),
            ("7", "settings", "at line 5"),
        ] {
            let error = with(settings).expect_err(settings);
            let at = matches!(&error, Error::Scene { path: at, .. } | Error::Invalid { field: at, .. } if at.starts_with(path));
            assert!(at && error.to_string().contains(text), "{settings}: {error}");
        }
    }

    #[test]
    fn misfits_are_told_in_words_of_json() {
        for (set, text) in [
            ("materials[0].model=sand", "a name alone, expected an object with that name as its key: {\"name\": {}}"),
            ("domain.walls=open", "domain.walls: invalid type: string \"open\", expected an object"),
            ("domain.min=[0, 0]", "expected an array of 3 numbers"),
            ("spawns[0]=[]", "spawns[0]: invalid length 0, expected an object"),
            ("spawns={}", "spawns: invalid type: an object, expected an array"),
            ("spawns[0].shape={}", "spawns[0].shape: invalid value: an object, expected one with a single key"),
            ("settings.dt=fast", "settings.dt: invalid type: string \"fast\", expected a finite number"),
            (
                "settings.iterations=-3",
                "settings.iterations: invalid value: integer `-3`, expected a whole number from 0 to 4294967295",
            ),
        ] {
            let mut document: Value = serde_json::from_str(SCENE).unwrap();
            apply_override(&mut document, set).unwrap();
            let error = from_value(document).expect_err(set).to_string();
            assert!(error.contains(text), "{error}");
        }
    }

    #[test]
    fn overrides_set_one_place() {
        let mut document: Value = serde_json::from_str(SCENE).unwrap();
        for set in ["settings.dt=0.01", "materials[0].name=oil", "spawns[0].material=oil", "domain.min[1]=-1e0"] {
            apply_override(&mut document, set).unwrap();
        }
        let world = from_value(document.clone()).unwrap();
        assert_eq!((world.settings.dt, world.domain.min.y), (0.01, -1.0));
        assert_eq!((&*world.materials[0].name, &*world.spawns[0].material), ("oil", "oil"));
        let before = document.clone();
        for (set, path) in [
            ("settings.dt", "settings.dt"),
            ("=1", "=1"),
            ("materials[1].name=a", "materials[1]"),
            ("materials[x]=1", "materials[x]"),
            ("materials.name=1", "materials"),
            ("domain[0]=1", "domain"),
            ("domain.cell_size.x=1", "domain.cell_size"),
            ("colliders[0].shape.box=1", "colliders[0].shape"),
            ("domain..min=1", "domain..min=1"),
        ] {
            let error = apply_override(&mut document, set).expect_err(set);
            assert!(matches!(&error, Error::Scene { path: found, .. } if found == path), "{set}: {error:?}");
            assert_eq!(document, before);
        }
        for value in ["1e999", " -1e999"] {
            let error = apply_override(&mut document, &format!("settings.dt={value}")).expect_err(value).to_string();
            assert_eq!(
                error,
                format!("settings.dt = {}: must be a finite number, less than 1.8e308 in size", value.trim())
            );
        }
        apply_override(&mut document, "setings.dt=0.01").unwrap();
        assert!(matches!(from_value(document), Err(Error::Scene { path, .. }) if path == "setings"));
    }
}

//! Any text is a world that holds to its own rules and survives being written, or an error with words.

#![no_main]

use libfuzzer_sys::{Corpus, fuzz_target};
use pbmpm::scene;

fuzz_target!(|bytes: &[u8]| -> Corpus {
    let Ok(text) = std::str::from_utf8(bytes) else { return Corpus::Reject };
    match scene::from_json(text) {
        Ok(world) => {
            assert_eq!(world.validate(), Ok(()));
            assert_eq!(scene::from_json(&scene::to_json(&world)), Ok(world));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    // An import is either refused or a world as well.
    if let Ok(import) = scene::lewin::from_json(text, &scene::lewin::Slab::default()) {
        assert_eq!(import.world.validate(), Ok(()));
    }
    Corpus::Keep
});

// Loads: what contact exerts on the bodies for which it is measured. Twin: src/stages/load.rs. Needs the bindings
// constants, colliders, counters.
#import sum64

const NO_LOAD = 0xffffffffu;
// Mass of the point in contact, in units of a load per displacement.
var<private> load_weight: f32;

// Adds a rounded number to a sum.
fn add_to_load(word: u32, value: f32) {
    let whole = wide(value);
    let high = carried(atomicAdd(&counters.loads[word], whole.x), whole);
    if high != 0u {
        atomicAdd(&counters.loads[word + 1u], high);
    }
}

// Adds to a body's load that it has taken the motion `taken` from the point at `x`. Blocks are spread over the copies
// of a load, so that fewer of them add to the same one at a time.
fn note_load(c: u32, block: u32, x: vec3f, taken: vec3f) {
    let impulse = taken * load_weight;
    add_impulse(c, block, impulse, cross3(x - colliders[c].position, impulse));
}

// Adds an impulse and its moment about the body's position.
fn add_impulse(c: u32, block: u32, impulse: vec3f, angular: vec3f) {
    let copies = constants.load_copies;
    let first = (colliders[c].load * copies + block % copies) * LOAD_WORDS;
    add_to_load(first, impulse.x);
    add_to_load(first + 2u, impulse.y);
    add_to_load(first + 4u, impulse.z);
    add_to_load(first + 6u, angular.x);
    add_to_load(first + 8u, angular.y);
    add_to_load(first + 10u, angular.z);
}

#if STICKS
// Adds to a body's load that it has changed the displacement and the gradient of a particle at `x` by these amounts.
// The moments of inertia of a particle are a quarter of its mass.
fn note_lacking(c: u32, block: u32, x: vec3f, u: vec3f, d: mat3x3f) {
    let impulse = -u * load_weight;
    let spin = vec3f(d[1][2] - d[2][1], d[2][0] - d[0][2], d[0][1] - d[1][0]);
    let angular = cross3(x - colliders[c].position, impulse) - spin * (0.25 * load_weight);
    add_impulse(c, block, impulse, angular);
}
#endif

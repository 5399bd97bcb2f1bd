//! The constants that the shaders share with Rust.

use super::coupling::{IMAGES, MATRIX, MOTIONS, SOURCES, VECTORS, WORK};
use super::solve::{LARGEST, WHOLE};
use super::{DISTANCES_WIDTH, GROUP, MAX_GROUPS, SLOTS, TOOLS};
use crate::bins::{EDGE, KEY_BITS, LAST_BLOCK, NODES, NONE, TILE_EDGE, TILE_NODES};
use crate::cpu::solve::{IN_COMMON, LEAST_BOUND, LEAST_COUNTED, LEAST_FIRST, MOST_FIRST, MOTION_SCALE, PRECISION};
use crate::cpu::state::{DRAINED, ESCAPED, QUARANTINED, VACANT};
use crate::gpu::shader::Variant;
use crate::gpu::tuning::FEWEST_LANES;
use crate::load::SUMS;
use crate::math::distance_grid::REACH;
use crate::math::fixed::CHUNK;
use crate::math::kernel::KERNEL_REACH;
use crate::math::{sdf, svd};
use crate::sensor;
use crate::stages::believed::{BESIDE_SOLIDS, LOOSE};
use crate::stages::bin_sleep::{ASLEEP, AWAKE, BORDER, DEEP, REACHED};
use crate::stages::bin_wake::{DISTURBED, DROWSY, RESTLESS, WOKEN};
use crate::stages::block_p2g::{BLOCK_SCALE, LEAST_PRESSURE, MOST_SHARED, SLACK};
use crate::stages::block_solve::{LEAST_SQUARE, LEFT, ROUNDS};
use crate::stages::collider_cull::{BLOCK_RADIUS, BODIES_PER_WORD, LEAST_REACH, MORE, MOST_WORDS, ROUNDING, TO_MIDDLE};
use crate::stages::compliance::{EARLIER, LATER, RESOLVED, SOLID_LIMIT, SOLID_SHARE, THICKEST};
use crate::stages::contact::{FIXED, LEAST_SHARE, STICKING, STUCK, SWEEPS};
use crate::stages::corner::{APART, LEAST_CHANGE, TOGETHER};
use crate::stages::correction::{ALL_SEEN, LEAST_SEEN, LEAST_SEEN_BY_LIQUIDS};
use crate::stages::drag::MOST_BRAKED;
use crate::stages::even::{NOTHING, ONE_SIDED, SOME, SPARSE};
use crate::stages::faces::{ABOVE, BELOW};
use crate::stages::footing::{FARTHEST_OFF, MOVED, ROUNDED};
use crate::stages::gap::{
    BESIDE, ELASTIC_NEAR, FACE_BITS, FACE_ON, LIQUID_NEAR, NODES_PER_WORD, NONE_NEAR, OPPOSITE, PARTS, SAND_NEAR,
    TOUCHING, VISCOPLASTIC_NEAR, WIDEST,
};
use crate::stages::integrate::{LOOSENING, MEASURE_MARGIN, OF_ITSELF, SHORTFALL, UNDER_PRESSURE, VOLUME_RATIO};
use crate::stages::joint::{FAR_BEHIND, FIRST_EDGE, JOINT_DEPTH};
use crate::stages::line::LEADING;
use crate::stages::load::MOST_WHOLE;
use crate::stages::matter::{AT_REST, CLEARANCE, CROWDED, EARLY, FULL, FULLEST, ON_SURFACE};
use crate::stages::motion::{FARTHEST, LEAST_MOTION};
use crate::stages::predict::{ACROSS, ALONG, NEARER, NO_BODY, SLIGHT, TOUCH};
use crate::stages::press::{MAX_DIVERGENCE, MAX_ERROR, MAX_LOAD, MAX_PRESSURE, MAX_SHEAR, MAX_SOFTENING};
use crate::stages::room::{FADING, HIDDEN, SIGHT};
use crate::stages::seam::{ALIKE, BESIDE_SEAM, BEVEL, FACING, LEAST_LEFT, NOTHING_ELSE, SEAM};
use crate::stages::sides::EDGE_REACH;
use crate::stages::solid::{self, CORRECTION, SLACKEST, STRETCH};
use crate::stages::stress::{FIRMEST, FIRMING, SOFT, SOFTENED};
use crate::stages::swept::{MENDS, PIECES, ROUGH};
use crate::stages::tool::CORE;
use crate::stages::walls::ON_NODES;
use crate::timeline::disturbance::DISTURBANCES;
use crate::units::FIRST_BETWEEN;

/// They as WGSL text.
pub fn shared_constants(variant: &Variant) -> String {
    let numbers = [
        ("GROUP", GROUP),
        ("LANES", variant.tuning.lanes),
        ("SHARE", variant.tuning.share),
        ("FEWEST_LANES", FEWEST_LANES),
        ("LINKERS", variant.tuning.linkers()),
        ("MAX_GROUPS", MAX_GROUPS),
        ("CHUNK", CHUNK),
        ("SLOTS", SLOTS),
        ("EDGE", EDGE as u32),
        ("NODES", NODES as u32),
        ("TILE_EDGE", TILE_EDGE as u32),
        ("TILE_NODES", TILE_NODES as u32),
        ("NONE", NONE),
        ("KEY_BITS", KEY_BITS),
        ("LAST_BLOCK", LAST_BLOCK),
        ("MATERIALS", variant.materials.max(1) as u32),
        ("MESHES", variant.shapes.meshes),
        ("DISTANCES_WIDTH", DISTANCES_WIDTH),
        ("SWEEPS", SWEEPS as u32),
        ("PIECES", PIECES as u32),
        ("SVD_SWEEPS", svd::SWEEPS as u32),
        ("MENDS", MENDS as u32),
        ("SHAPE_BOX", sdf::BOX),
        ("SHAPE_SPHERE", sdf::SPHERE),
        ("SHAPE_HALF_SPACE", sdf::HALF_SPACE),
        ("MODEL_ELASTIC", solid::ELASTIC),
        ("MODEL_SAND", solid::SAND),
        ("MODEL_VISCOPLASTIC", solid::VISCOPLASTIC),
        ("MODEL_LIQUID", solid::LIQUID),
        ("SHAPE_CAPSULE", sdf::CAPSULE),
        ("SHAPE_CYLINDER", sdf::CYLINDER),
        ("SHAPE_GRID", sdf::GRID),
        ("INVERTED", sdf::INVERTED),
        ("ABOVE_FACE", ABOVE),
        ("BELOW_FACE", BELOW),
        ("LOAD_WORDS", 2 * SUMS as u32),
        ("SENSED_WORDS", 2 * sensor::SUMS as u32),
        ("TOOLS", TOOLS as u32),
        ("DISTURBANCES", DISTURBANCES as u32),
        ("AWAKE", AWAKE),
        ("BORDER", BORDER),
        ("DEEP", DEEP),
        ("REACHED", REACHED),
        ("ASLEEP", ASLEEP),
        ("RESTLESS", RESTLESS),
        ("DROWSY", DROWSY),
        ("WOKEN", WOKEN),
        ("DISTURBED", DISTURBED),
        ("LIQUID_NEAR", LIQUID_NEAR),
        ("SAND_NEAR", SAND_NEAR),
        ("VISCOPLASTIC_NEAR", VISCOPLASTIC_NEAR),
        ("ELASTIC_NEAR", ELASTIC_NEAR),
        ("NONE_NEAR", NONE_NEAR),
        ("FACE_BITS", FACE_BITS),
        ("NODES_PER_WORD", NODES_PER_WORD as u32),
        ("LARGEST", LARGEST.len() as u32),
        ("SUM_WORDS", 2 * WHOLE.len() as u32),
        ("SOURCES", SOURCES as u32),
        ("MATRIX", MATRIX as u32),
        ("MOTIONS", MOTIONS as u32),
        ("IMAGES", IMAGES as u32),
        ("WORK", WORK as u32),
        ("VECTORS", VECTORS as u32),
    ];
    let places = LARGEST.iter().zip(0..).chain(WHOLE.iter().zip((0..).step_by(2)));
    let numbers = numbers.iter().copied().chain(places.map(|(name, place)| (*name, place)));
    let text: String = numbers.map(|(name, value)| format!("const {name} = {value}u;\n")).collect();
    let [low, high] = VOLUME_RATIO;
    text + &format!(
        "const MIN_VOLUME_RATIO = {low:?};
const MAX_VOLUME_RATIO = {high:?};
const MIN_STRETCH = {:?};
const MAX_STRETCH = {:?};
const MAX_CORRECTION = {:?};
const SLACKEST = {SLACKEST:?};
const ESCAPED = {ESCAPED:?};
const QUARANTINED = {QUARANTINED:?};
const DRAINED = {DRAINED:?};
const VACANT = {VACANT:?};
const SENSED_MASS = {:?};
const REACH = {REACH:?};
const FIXED = {FIXED:?};
const STICKING = {STICKING:?};
const STUCK = {STUCK:?};
const MAX_PRESSURE = {MAX_PRESSURE:?};
const MAX_DIVERGENCE = {MAX_DIVERGENCE:?};
const MAX_ERROR = {MAX_ERROR:?};
const MAX_LOAD = {MAX_LOAD:?};
const MAX_SHEAR = {MAX_SHEAR:?};
const BLOCK_SCALE = {BLOCK_SCALE:?};
const SLACK = {SLACK:?};
const FILLED = {:?};
const PRESSED = {:?};
const LEAST_PRESSURE = {LEAST_PRESSURE:?};
const LEAST_SQUARE = {LEAST_SQUARE:?};
const LEFT = {LEFT:?};
const LEADING = {:?};
const ROUNDS = {ROUNDS}u;
const MAX_SOFTENING = {MAX_SOFTENING:?};
const SOLID_SHARE = {SOLID_SHARE:?};
const SOLID_LIMIT = {SOLID_LIMIT:?};
const THICKEST = {THICKEST:?};
const LATER = {LATER:?};
const EARLIER = {EARLIER:?};
const RESOLVED = {RESOLVED:?};
const MOTION_SCALE = {MOTION_SCALE:?};
const PRECISION = {PRECISION:?};
const LEAST_COUNTED = {LEAST_COUNTED:?};
const LEAST_BOUND = {LEAST_BOUND:?};
const IN_COMMON = {IN_COMMON:?};
const LEAST_FIRST = {LEAST_FIRST:?};
const MOST_FIRST = {MOST_FIRST:?};
const MOST_WHOLE = {MOST_WHOLE:?};
const NOTHING = {NOTHING:?};
const FIRMEST = {FIRMEST:?};
const FIRMING = {FIRMING:?};
const SOFT = {SOFT:?};
const SOFTENED = {SOFTENED:?};
const CLEARANCE = {CLEARANCE:?};
const ON_SURFACE = {ON_SURFACE:?};
const EARLY = {EARLY:?};
const AT_REST = {AT_REST:?};
const CROWDED = {CROWDED:?};
const SEAM = {SEAM:?};
const ROUGH = {ROUGH:?};
const ROUNDED = {ROUNDED:?};
const FARTHEST_OFF = {FARTHEST_OFF:?};
const MOVED = {MOVED:?};
const KERNEL_REACH = {KERNEL_REACH:?};
const NOTHING_ELSE = {NOTHING_ELSE:?};
const BESIDE_SEAM = {BESIDE_SEAM:?};
const FACING = {FACING:?};
const BEVEL = {BEVEL:?};
const ALIKE = {ALIKE:?};
const LEAST_LEFT = {LEAST_LEFT:?};
const EDGE_REACH = {EDGE_REACH:?};
const FIRST_EDGE = {FIRST_EDGE}u;
const JOINT_DEPTH = {JOINT_DEPTH:?};
const FAR_BEHIND = {FAR_BEHIND:?};
const FULL = {FULL:?};
const FULLEST = {FULLEST:?};
const LEAST_SHARE = {LEAST_SHARE:?};
const TOGETHER = {TOGETHER:?};
const APART = {APART:?};
const LEAST_CHANGE = {LEAST_CHANGE:?};
const MEASURE_MARGIN = {MEASURE_MARGIN:?};
const SHORTFALL = {SHORTFALL:?};
const LOOSENING = {LOOSENING:?};
const OF_ITSELF = {OF_ITSELF:?};
const UNDER_PRESSURE = {UNDER_PRESSURE:?};
const FIRST_BETWEEN = {FIRST_BETWEEN:?};
const HIDDEN = {HIDDEN:?};
const SIGHT = {SIGHT:?};
const FADING = {FADING:?};
const ON_NODES = {ON_NODES:?};
const CORE = {CORE:?};
const BESIDE_SOLIDS = {BESIDE_SOLIDS:?};
const LOOSE = {LOOSE:?};
const SOME = {SOME:?};
const SPARSE = {SPARSE:?};
const ONE_SIDED = {ONE_SIDED:?};
const NO_BODY = {NO_BODY}u;
const TOUCH = {TOUCH:?};
const SLIGHT = {SLIGHT:?};
const NEARER = {NEARER:?};
const ALONG = {ALONG:?};
const ACROSS = {ACROSS:?};
const WIDEST = {WIDEST:?};
const LEAST_REACH = {LEAST_REACH:?};
const TO_MIDDLE = {TO_MIDDLE:?};
const BLOCK_RADIUS = {BLOCK_RADIUS:?};
const ROUNDING = {ROUNDING:?};
const BODIES_PER_WORD = {BODIES_PER_WORD}u;
const MORE = {MORE}u;
const MOST_WORDS = {MOST_WORDS}u;
const LEAST_SEEN = {LEAST_SEEN:?};
const ALL_SEEN = {ALL_SEEN:?};
const LEAST_SEEN_BY_LIQUIDS = {LEAST_SEEN_BY_LIQUIDS:?};
const MOST_BRAKED = {MOST_BRAKED:?};
const FARTHEST = {FARTHEST:?};
const LEAST_MOTION = {LEAST_MOTION:?};
const PARTS = {PARTS:?};
const BESIDE = {BESIDE:?};
const OPPOSITE = {OPPOSITE:?};
const TOUCHING = {TOUCHING:?};
const FACE_ON = {FACE_ON:?};
",
        STRETCH[0],
        STRETCH[1],
        CORRECTION,
        sensor::MASS_SCALE,
        1.0 - SLACK,
        1.0 - MOST_SHARED,
        LEADING * f64::from(f32::EPSILON)
    )
}

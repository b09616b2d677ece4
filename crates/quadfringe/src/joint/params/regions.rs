//! Step 8: the orders of regions.

/// Side of a tile in fringe periods. Larger: two surfaces in one tile share an order. Smaller: a part of a fringe fits every order.
/// When it was set, three points less of spheres of 2 % of the frame were right with 1 (`python evaluation/isolated.py --surface sphere`).
pub const TILE_SIDE: f64 = 0.5;

/// Least side of a tile in camera pixels. Larger: mistakes of a narrow strip hide in the tiles around it.
/// Smaller: more tiles of fine fringes, and so more time. Not measured: it only counts for fringes that are finer.
pub const TILE_MIN_PX: usize = 24;

/// Number of rows from one that is added up to the next. Larger: less light counts. Smaller: time, of which these sums take most. Not
/// measured: rows next to each other hardly differ, because squares of [`SHARED_PX`] count as one.
pub const ROW_STEP: usize = 2;

/// Side in pixels of a square whose pixels err together, because edges of the albedo are as large. Larger: regions need more pixels
/// for the same certainty. Smaller: texture counts as evidence. Not measured: it scales the numbers below together.
pub const SHARED_PX: f32 = 4.0;

/// Least evidence for another order, as the logarithm of a ratio of likelihoods, from which a region takes it. Larger: wrong regions
/// keep their order. Smaller: right ones lose it (`python evaluation/world.py --half tune`, `python evaluation/isolated.py`). When it was
/// set, right regions of the half `tune` and of the captures had at most 2, wrong ones of small objects 7 and more.
pub const LEAD_MIN: f32 = 3.0;

/// Least evidence of a part alone, as [`LEAD_MIN`], for the order that the parts around it choose. Larger: parts of one order lose their
/// certainty by noise. Smaller: two surfaces that a gentle slope connects share an order that counts as certain (`python
/// evaluation/isolated.py --surface steps`).
pub const OWN_LEAD_MIN: f32 = -1.0;

/// Greatest evidence, as [`LEAD_MIN`], for shifts of G and IR that no order explains. Larger: broken parts of a shot are returned.
/// Smaller: painted surfaces become no data (`pytest tests/test_trusted.py -k half_of`, `python evaluation/world.py --half tune`). When
/// this was measured, photographs of the half `tune` had at most 67, all other scenes 30, shifted IR and exchanged channels 100 to 500.
/// Steps of less than a fringe have up to 70 (`pytest tests/test_soundness.py -k narrow`); a limit of 55 refused a part of them.
pub const CONTRADICTION_MAX: f32 = 80.0;

/// Shift of G in rad that contradicts no order. Larger: parts with shifted IR are returned. Smaller: crosstalk of 0.15 between R and G,
/// which turns G by as much, becomes no data (`pytest tests/test_channel_offsets.py -k crosstalk`).
pub const GREEN_OFF_RAD: f32 = 0.14;

/// Evidence, as [`LEAD_MIN`], at which an order counts as certain: less counts in proportion. Larger: narrow regions stay doubtful.
/// Smaller: chance makes them certain, and with 20 dark letters and bars of a print have a worse albedo (`pytest tests/test_albedo.py
/// -k print`, 3.24 % in place of 3.02); objects hardly change (`python evaluation/isolated.py --surface steps`).
pub const CERTAIN_EVIDENCE: f32 = 100.0;

/// Quality of an order that is certain by its region alone. Larger: the median quality tells exchanged channels less well, from 0.5 on
/// not at all (`pytest tests/test_verdict.py tests/test_real_objects.py`), and a response, which is found by the quality that it gains.
/// Smaller: narrow regions are no data where `quality_min` is raised.
pub const QUALITY: f32 = 0.35;

/// Number of shifts that are compared; a wrong order of IR is eight of them for fringe numbers of 36, 35 and 30. More: time. Fewer: the
/// shift that explains the light best is missed, and half as many do not tell the shift of G by crosstalk (`pytest
/// tests/test_channel_offsets.py -k crosstalk`).
pub const SHIFTS: usize = 48;

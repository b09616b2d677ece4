//! Step 3: the local fit.

/// Width (sigma) of the first window in fringe periods. It must average whole fringes. Larger: edges blur (varied x1.4: wrong
/// orders of the face 14 -> 447 ppm, near edges of steps +12 %). Smaller: it no longer holds a fringe (x0.7: phase RMS of peaks
/// without noise +19 %, near edges of steps -18 %).
pub const FIRST_WINDOW: f32 = 0.5;

/// Width (sigma) of the fitting window in fringe periods. Larger: less noise of beats, offsets and amplitudes. Smaller: they follow
/// edges. Varied x0.7: phase RMS of peaks without noise +42 %, promised wrong orders 15 to 60 % less; x1.4: near edges of steps +34
/// %, promised wrong orders of the textured face three times as many. 0.28: painted face +14 %, 0.34 points less of the bottle
/// (`python evaluation/captures_report.py`).
pub const WINDOW: f32 = 0.3;

/// Ridge of the normal equations relative to the weight in the window. Larger: offsets and amplitudes are pulled towards 0.
/// Smaller: windows without a whole fringe become singular. Varied: no effect, but 4 % near edges of dim steps at x0.7.
pub const RIDGE: f32 = 1e-3;

/// Least contrast (amplitude over offset) of R and B in light from the projector. With less, the evidence of G or of IR for an order
/// loses weight as the square of its contrast. Larger: surfaces under room light are lost. Smaller: room light counts as fringes, and
/// noise as evidence. Varied: 0.05, no effect; 0.2, 3 points less of objects of 2 % with fringes of 110 px, 0.2 points more of cloth
/// (`python evaluation/isolated.py`, `python evaluation/world.py --half tune --only painted_face clutter cloth`).
pub const CONTRAST_MIN: f32 = 0.1;

/// Least mean square of the phasor of R and B in any direction: 1/2 for whole fringes, 0 if all phasors lie along one line, as
/// when B repeats R. Larger: surfaces along the fringes are lost. Smaller: the phase is noise there. Varied: no effect.
pub const SPREAD_MIN: f32 = 0.02;

/// Widths (sigma) in fringe periods of the windows of the fits against a plane wave: of the ratio of R and B, or of R without a channel in
/// quadrature. Larger: the phase near edges is that of both sides. Smaller: a window holds less than a fringe, and offset and phase are
/// mixed. More fits follow greater changes of the local frequency, and each costs a pass over the image. By `python evaluation/rgb.py
/// --only face steps`, one fit leaves 15 % of wrong orders on the face, two and three leave none; three have 10 % less error near edges
/// than two. Varied: 0.25 in the second leaves 0.3 % of wrong orders on the steps, 0.7 in the first doubles the error of steps.
pub const CARRIER_WINDOWS: [f32; 3] = [0.5, 0.35, 0.35];

/// Greatest mean of the ratio of R and B that one of these fits takes for a tint, a factor of nine between both. Larger: in a window with
/// little light the tint grows without bound (it is infinite at 1). Smaller: strong tints take more fits. Follows from the range of the
/// ratio, -1 to 1, and the three fits, which reach a factor of 700.
pub const TINT_STEP_MAX: f32 = 0.8;

/// Width (sigma) in fringe periods of the window in which the two fits are compared. Larger: narrow objects and prints keep the worse fit.
/// Smaller: in a part of a fringe a wrong phase explains the light, too. Varied: 0.8, 94.2 in place of 99.97 % of a sphere have the right
/// order, and 90 in place of 98 % of a small object; 1.8, 92.5 % of it (`pytest tests/test_real_objects.py -rP`).
pub const COMPARED_WINDOW: f32 = 1.2;

/// Least misfit of the first fit from which a cell may keep the second one, in units of the noise. [`UNEXPLAINED_MIN`], in units of the
/// modulation, is added to it in squares. Larger: photographs keep more of their error (1.5: +18 % on one of two,
/// `pytest tests/test_texture.py -rP`). Smaller: chance decides between the fits, and a shot with wrong fringe numbers passes (0:
/// `pytest tests/test_hostile_shots.py`).
pub const UNEXPLAINED_NOISES_MIN: f32 = 1.2;
/// See [`UNEXPLAINED_NOISES_MIN`]. Larger: prints and photographs keep more of their error (0.2: albedo of a print +4 %, photographs +12 and
/// +21 %, `pytest tests/test_albedo.py tests/test_texture.py -rP`). Smaller: windows with two surfaces take the second fit, and a wrong order
/// with it (0.08: 94.2 in place of 99.97 % of a sphere, `pytest tests/test_real_objects.py -k cancel -rP`).
pub const UNEXPLAINED_MIN: f32 = 0.12;

/// Least share of the variance of the ratio of R and B that fringes of one surface explain, where a cell may keep the second fit. Larger:
/// squares of a fringe keep the first one (0.85: 87.9 in place of 90.8 % are right, `pytest tests/test_texture.py -rP`). Smaller: windows
/// with two surfaces take the second one (0: 95.4 in place of 95.7 % of a captured bottle, `pytest tests/test_captures.py -rP`).
pub const PURITY_MIN: f32 = 0.6;

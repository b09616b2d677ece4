//! What the fuzz target of `crates/quadfringe/fuzz` and the test `fuzzed` do with an input: the first byte chooses a target,
//! the others become its images and numbers.

mod code;
mod conditioning;
mod decoding;
mod devices;
mod input;
mod invariants;
mod shots;
mod single_stages;
mod surfaces;
mod virtual_bench;

use input::Input;

/// Targets in the order of the first byte of an input. Decoding comes twice, because it has the most code.
pub const TARGETS: [fn(&mut Input<'_>); 8] = [
    decoding::run,
    code::run,
    conditioning::run,
    devices::run,
    decoding::run,
    single_stages::run,
    surfaces::run,
    virtual_bench::run,
];

/// Runs the target that the first byte chooses; panics if the kernel panics or a result breaks an invariant.
pub fn run(data: &[u8]) {
    let Some((choice, rest)) = data.split_first() else { return };
    TARGETS[usize::from(*choice) % TARGETS.len()](&mut Input::new(rest));
}

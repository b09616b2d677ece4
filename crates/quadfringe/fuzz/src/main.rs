//! Random bytes as images, settings and calibrations of the kernel. `cargo test --test fuzzed` replays inputs that failed
//! once, through the same targets.
#![no_main]

#[path = "../../tests/fuzzed/targets/mod.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(|data: &[u8]| targets::run(data));

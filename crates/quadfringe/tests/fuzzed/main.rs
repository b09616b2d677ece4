//! The targets of the fuzzer (`make fuzz`), run by `cargo test`: inputs that failed once, and a sample of random ones.

mod targets;

use std::fs;
use std::path::Path;
use targets::TARGETS;

/// Random inputs of each target.
const SAMPLE: u32 = 40;
const BYTES: usize = 400;

#[test]
fn inputs_that_failed_once_pass() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut replayed = 0;
    for entry in fs::read_dir(&folder).expect("the folder of inputs") {
        let path = entry.expect("an input").path();
        println!("{}", path.display());
        targets::run(&fs::read(&path).expect("an input"));
        replayed += 1;
    }
    assert!(replayed > 0, "no inputs in {}", folder.display());
}

#[test]
fn random_inputs_pass() {
    let mut seed = 1u32;
    for target in 0..TARGETS.len() as u8 {
        for sample in 0..SAMPLE {
            println!("target {target}, sample {sample}");
            let mut byte = || {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (seed >> 24) as u8
            };
            let random: Vec<u8> = (0..BYTES).map(|_| byte()).collect();
            targets::run(&[&[target], random.as_slice()].concat());
        }
    }
}

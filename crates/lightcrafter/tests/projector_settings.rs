//! Light, triggers and geometry in physical units, on an emulated projector.
#![cfg(feature = "emulator")]

mod bench;

use bench::Bench;
use lightcrafter::command::*;
use lightcrafter::{Profile, TriggerOut, Triggers};

#[test]
fn the_drive_of_the_leds_is_in_units_of_brightness() {
    let mut bench = Bench::new();
    assert_eq!(bench.projector.led_drive().unwrap(), Profile::POWER_ON_DRIVE);
    bench.projector.set_led_drive([0, 50, 130]).unwrap();
    assert_eq!(bench.projector.read::<LedCurrent>().unwrap().raw, [255, 205, 125]);
    assert_eq!(bench.projector.led_drive().unwrap(), [0, 50, 130]);
    let sent = bench.writes(0x0B01);
    assert!(bench.projector.set_led_drive([105, 0, 0]).is_err());
    assert_eq!(bench.writes(0x0B01), sent);
    bench.projector.write(&LedPolarity::Inverted).unwrap();
    assert!(bench.projector.set_led_drive([1, 1, 1]).unwrap_err().to_string().contains("Normal"));
    assert_eq!(bench.writes(0x0B01), sent);
    let mut infrared = Bench::with(Profile::EXTERNAL);
    assert!(
        infrared.projector.set_led_drive([0; 3]).unwrap_err().to_string().contains("stated in the profile")
    );
}

#[test]
fn light_triggers_and_geometry_are_set_in_physical_units() {
    let mut bench = Bench::new();
    let triggers = Triggers {
        out_1: TriggerOut { inverted: true, rising_us: -1.072, falling_us: 2.144 },
        out_2: TriggerOut { inverted: false, rising_us: 5.36, falling_us: 0.0 },
        in_1_delay_us: 1071.36,
        in_2_edge: TriggerIn2Edge::Falling,
    };
    bench.projector.set_triggers(&triggers).unwrap();
    let found = bench.projector.triggers().unwrap();
    assert!((found.out_1.rising_us + 1.072).abs() < 1e-9 && (found.out_2.rising_us - 5.36).abs() < 1e-9);
    assert!((found.in_1_delay_us - 1071.36).abs() < 1e-6 && found.out_1.inverted && !found.out_2.inverted);
    let late = Triggers { out_1: TriggerOut { falling_us: 3.0, ..triggers.out_1 }, ..triggers };
    assert!(bench.projector.set_triggers(&late).is_err());
    bench.projector.set_leds(LedEnable { red: true, ..LedEnable::default() }).unwrap();
    bench.projector.set_led_delays_us([0.0, 1.072, -1.072], [0.0; 3]).unwrap();
    assert_eq!(bench.projector.read::<GreenLedDelay>().unwrap().rising, EdgeDelay(0xC5));
    assert!(bench.projector.set_led_delays_us([9.0, 0.0, 0.0], [0.0; 3]).is_err());
    bench.projector.set_flips(true, false).unwrap();
    assert_eq!(bench.projector.flips().unwrap(), (true, false));
    bench.projector.set_gamma(Gamma { enabled: true, table: 1 }).unwrap();
    bench.projector.set_inverted(true).unwrap();
    assert_eq!(bench.projector.read::<InvertData>().unwrap(), InvertData(true));
}

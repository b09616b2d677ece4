//! Show one colour image from flash, provoke two errors, and stop. The projector is emulated, so the example runs anywhere.
//!
//! For a real projector, replace the emulator by `LightCrafter::open(&Selector::Port("1-2".parse()?))`.

use lightcrafter::emulator::{Dlpc350, EmulatedTransport, Fault};
use lightcrafter::sequence::colour_channels;
use lightcrafter::{Error, LightCrafter, Sequence};
use std::sync::PoisonError;

fn main() -> Result<(), Error> {
    let transport = EmulatedTransport::new(Dlpc350::default());
    let device = transport.device();
    let mut projector = LightCrafter::new(transport);

    println!(
        "firmware {}, {} images in flash",
        projector.versions()?.application,
        projector.flash_image_count()?
    );
    let validation = projector.play(&Sequence::from_flash(0, colour_channels(8), 8333))?;
    println!("running: {}, warnings: {:?}", projector.status()?.main.running, validation.warnings());

    // Too short for 8 bit: refused before anything is sent.
    match projector.load(&Sequence::from_flash(0, colour_channels(8), 5000)) {
        Err(error @ Error::Value { .. }) => println!("refused: {error}"),
        other => drop(other?),
    }

    device.lock().unwrap_or_else(PoisonError::into_inner).inject(Fault::Unplug, 1);
    match projector.stop() {
        Err(error @ Error::Disconnected { .. }) => println!("unplugged: {error}"),
        other => other?,
    }
    Ok(())
}

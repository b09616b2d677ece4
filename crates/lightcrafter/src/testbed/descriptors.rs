//! USB descriptors of the device: a composite HID with two interfaces, commands on the first.

/// Report descriptor: 64 bytes in, 64 bytes out, vendor page 0xFF00.
const REPORT_DESCRIPTOR: [u8; 32] = [
    0x06, 0x00, 0xFF, 0x0A, 0x00, 0xFF, 0xA1, 0x01, 0x09, 0x01, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08,
    0x95, 0x40, 0x81, 0x02, 0x09, 0x02, 0x15, 0x00, 0x75, 0x08, 0x95, 0x40, 0x91, 0x02, 0xC0,
];

/// USB 1.1, 0451:6401, strings 1 to 3, one configuration.
const DEVICE: [u8; 18] = [18, 1, 0x10, 0x01, 0, 0, 0, 64, 0x51, 0x04, 0x01, 0x64, 0, 0, 1, 2, 3, 1];

const CONFIGURATION_HEADER: usize = 9;

/// The configuration with both interfaces and their endpoints.
fn configuration() -> Vec<u8> {
    let interfaces = [interface(0, 1), interface(1, 2)].concat();
    let total = ((CONFIGURATION_HEADER + interfaces.len()) as u16).to_le_bytes();
    let mut bytes = vec![9, 2, total[0], total[1], 2, 1, 0, 0xC0, 50];
    bytes.extend(interfaces);
    bytes
}

fn interface(number: u8, endpoint: u8) -> Vec<u8> {
    let length = (REPORT_DESCRIPTOR.len() as u16).to_le_bytes();
    let mut bytes = vec![9, 4, number, 0, 2, 3, 0, 0, 0];
    bytes.extend([9, 0x21, 0x11, 0x01, 0, 1, 0x22, length[0], length[1]]);
    bytes.extend([7, 5, 0x80 | endpoint, 3, 64, 0, 1]);
    bytes.extend([7, 5, endpoint, 3, 64, 0, 1]);
    bytes
}

/// The descriptors as Linux stores them in `/sys` and in the device node.
pub fn stored() -> Vec<u8> {
    [DEVICE.to_vec(), configuration()].concat()
}

/// Reply to a control request; `None` is a stall.
pub fn control_answer(setup: &[u8; 8]) -> Option<Vec<u8>> {
    let (kind, index) = (setup[3], setup[2]);
    let length = usize::from(u16::from_le_bytes([setup[6], setup[7]]));
    let mut answer = match (setup[0], setup[1], kind) {
        (0x80, 6, 1) => DEVICE.to_vec(),
        (0x80, 6, 2) => configuration(),
        (0x80, 6, 3) => string(index)?,
        (0x81, 6, 0x22) => REPORT_DESCRIPTOR.to_vec(),
        (0x21, 0x0A, _) => Vec::new(),
        _ => return None,
    };
    answer.truncate(length);
    Some(answer)
}

fn string(index: u8) -> Option<Vec<u8>> {
    let text = match index {
        0 => return Some(vec![4, 3, 9, 4]),
        1 => "Texas Instruments Inc.",
        2 => "DLPC350",
        3 => "LCR2",
        _ => return None,
    };
    let units: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let mut bytes = vec![2 + units.len() as u8, 3];
    bytes.extend(units);
    Some(bytes)
}

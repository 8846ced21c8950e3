//! Against the codec's reference encoder, and against damage.

use super::*;

// The packed bytes were written by the codec's reference encoder from the formulas in the tests.
const COUNT: usize = 40;
const SHORTS_0: &str = "a01f004a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a7a4a4a4affff00004a4a4a4a4a4a\
    4a4a1500020008002000c005080000001f0002060a0e12161a1e22262a2e32363a3e42464a4e52565a5e6266\
    f06e72767affff00007e82868a8e92e39a148002030203020c00000300001f00807f807f807f807f807f807f\
    807f807f807f807f807f807f807f807f807f80ffff00007f807f807f807f801f00c7c8c7c8c7c8c7c8c7c8c7\
    c8c7c8c7c8c7c8c7c8c7c8c7c8c7c8c7c8c7c8c7ffff0000c8c7c8c7c8c7c8c7000000000000000000000000\
    0000000000000000000000000000000005000000";
const SHORTS_1: &str = "a133e9004a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a854a4a4a4a4a4a4a4a4a4a4a04\
    0010070002060a0e12161a1e22262a2e32363a3e42464a4e52565a5e62660f6e72767a7e82868a8e92e39a14\
    000805400004152aaaaaaaaaaaaaaaaaaa000000717171717171717171717171717171717171717171717171\
    717171717171717171717171717171000000000000000000000000000000000000050000000122";
const FLOATS_1: &str = "a19a782a04444444444444444444444444444444444444440000000005020001800003000000808040c0a020\
    1050d010c86828088494b4e4a474b2a262aafa92b29a8a8241c54dd949fd55060ffc42f26131f131dc381e0f\
    c4c704c40703ff031100070100000000000000000000000000000000803f000000800032";
const TRIANGLES: &str =
    "e1fe1e100e100e8e1e140e130eff0f086ff20dd8b708007687566778a9866589689801690000";
const SEQUENCE: &str = "d100040c000a100e040c000a100e040c000a100a040c000a100e040c000a100e040c000a10911c1eb1ef1000\
    000000";
const INDICES: [u32; 39] = [
    0, 1, 4, 4, 1, 5, 1, 2, 5, 5, 2, 6, 2, 3, 6, 6, 3, 7, 4, 5, 8, 8, 5, 9, 5, 6, 9, 9, 6, 10, 6,
    7, 10, 10, 7, 11, 900, 3, 70000,
];

fn bytes(hex: &str) -> Vec<u8> {
    let digit = |b: &u8| char::from(*b).to_digit(16).unwrap() as u8;
    let pair = |p: &[u8]| 16 * digit(&p[0]) + digit(&p[1]);
    hex.as_bytes().chunks(2).map(pair).collect()
}

fn shorts() -> Vec<u8> {
    let row = |i: usize| [i * 37 % 1000, i * i % 701, 5, i % 2 * 40000];
    let rows = (0..COUNT).flat_map(row);
    rows.flat_map(|x| (x as u16).to_le_bytes()).collect()
}

fn attributes(hex: &str, filter: &str, stride: u64, count: u64) -> Vec<u8> {
    unpack(&bytes(hex), "ATTRIBUTES", filter, stride, count).unwrap()
}

#[test]
fn attributes_of_both_versions() {
    assert_eq!(attributes(SHORTS_0, "NONE", 8, 40), shorts());
    assert_eq!(attributes(SHORTS_1, "NONE", 8, 40), shorts());
    let row = |i: usize| [1.0 + i as f32 / 64.0, -((i * i) as f32) / 256.0];
    let floats = (0..COUNT).flat_map(row).flat_map(f32::to_le_bytes);
    assert_eq!(
        attributes(FLOATS_1, "NONE", 8, 40),
        floats.collect::<Vec<_>>()
    );
}

#[test]
fn sixteen_differences_of_the_specification() {
    let packed = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
    let mut group = [0; 16];
    let mut input = Input {
        bytes: &packed,
        at: 0,
    };
    differences(&mut input, 4, &mut group).unwrap();
    let signed = group.map(|d| advance([0; 4], [d, 0, 0, 0], 0)[0] as i8);
    let expected = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0];
    assert_eq!(signed, expected);
    assert!(input.finish().is_ok());
}

#[test]
fn triangles_and_sequences() {
    for (mode, hex) in [("TRIANGLES", TRIANGLES), ("INDICES", SEQUENCE)] {
        let unpacked = unpack(&bytes(hex), mode, "NONE", 4, 39).unwrap();
        let indices = unpacked.chunks_exact(4);
        let indices: Vec<u32> = indices
            .map(|b| u32::from(half(b, 0)) | u32::from(half(b, 1)) << 16)
            .collect();
        if mode == "INDICES" {
            assert_eq!(indices, INDICES);
            continue;
        }
        // The encoder may begin a triangle at another corner.
        let turned = |t: &[u32]| (0..3).map(|k| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]).min();
        assert!(
            indices
                .chunks(3)
                .map(turned)
                .eq(INDICES.chunks(3).map(turned))
        );
        assert_ne!(indices, INDICES);
    }
    let short = unpack(&bytes(SEQUENCE), "INDICES", "NONE", 2, 39).unwrap();
    assert!(
        short
            .chunks_exact(2)
            .zip(INDICES)
            .all(|(b, i)| half(b, 0) == i as u16)
    );
}

#[test]
fn filters_give_back_what_was_filtered() {
    let unit = [
        [0.0, 0.0, 1.0],
        [0.6, 0.0, -0.8],
        [-0.48, 0.64, 0.6],
        [0.0, -1.0, 0.0],
    ];
    let octahedral = "a1fffa00017376000e130600dbd00e00080313000403fd000000ff000000000000000000000000000000000000ff07ff7f0001";
    let out = attributes(octahedral, "OCTAHEDRAL", 8, 4);
    for (row, unit) in out.chunks_exact(8).zip(unit) {
        for (k, expected) in unit.into_iter().enumerate() {
            let value = f64::from(half(row, k) as i16) / 32767.0;
            assert!((value - expected).abs() < 2e-3);
        }
    }
    let octahedral = "a1ef00febc46009233a4000403fd0000000000000000000000000000000000000000007f7f00";
    let out = attributes(octahedral, "OCTAHEDRAL", 4, 4);
    for (row, unit) in out.chunks_exact(4).zip(unit) {
        for (k, expected) in unit.into_iter().enumerate() {
            assert!((f64::from(row[k] as i8) / 127.0 - expected).abs() < 2e-2);
        }
    }
    let quaternion = "a1ffbf00fcfb3400b5b62400fb343400b4242400fbfc3400b4b324000500020000000000000000000000000000000000000000ff7f0000";
    let out = attributes(quaternion, "QUATERNION", 8, 4);
    let expected = [
        [0.0, 0.0, 0.0, 1.0],
        [0.5, -0.5, 0.5, 0.5],
        [0.8, 0.0, 0.6, 0.0],
        [0.1, 0.7, 0.1, 0.7],
    ];
    for (row, q) in out.chunks_exact(8).zip(expected) {
        let value = |k: usize| f64::from(half(row, k) as i16) / 32767.0;
        // A quaternion and its negative are one rotation.
        let dot: f64 = (0..4).map(|k| value(k) * q[k]).sum();
        assert!((dot.abs() - 1.0).abs() < 1e-4);
    }
    let exponential =
        "a1ff0000d98600602f0f001b18000012259c00000000000000000000000000000000000000000006ee00";
    let out = attributes(exponential, "EXPONENTIAL", 4, 4);
    for (row, x) in out.chunks_exact(4).zip([1.5f32, -1000.0, 0.001, 3e20]) {
        let value = f32::from_le_bytes([row[0], row[1], row[2], row[3]]);
        assert!((value / x - 1.0).abs() < 4e-6);
    }
    let colors = [
        [1.0, 0.0, 0.0, 1.0],
        [0.2, 0.4, 0.6, 0.8],
        [0.0; 4],
        [1.0, 1.0, 1.0, 0.5],
    ];
    let color =
        "a1ff004ccb01009c6600007e00000031cb8000000000000000000000000000000000000000407fc1ff00";
    let out = attributes(color, "COLOR", 4, 4);
    for (value, expected) in out.iter().zip(colors.as_flattened()) {
        assert!((f64::from(*value) / 255.0 - expected).abs() < 1e-2);
    }
    let color = "a1ffff00cccb01004ccc00009c660000996600000100000080000000cecb000031cb8000000000000000000000000000000040ff7f01c0ffff0100";
    let out = attributes(color, "COLOR", 8, 4);
    for (value, expected) in out.chunks_exact(2).zip(colors.as_flattened()) {
        assert!((f64::from(half(value, 0)) / 65535.0 - expected).abs() < 1e-3);
    }
}

#[test]
fn damaged_data_is_refused() {
    let truncated =
        |r: Result<Vec<u8>, MeshoptError>| matches!(r, Err(MeshoptError::Truncated { .. }));
    for (mode, hex, stride, count) in [
        ("ATTRIBUTES", SHORTS_0, 8, 40),
        ("ATTRIBUTES", SHORTS_1, 8, 40),
        ("TRIANGLES", TRIANGLES, 4, 39),
        ("INDICES", SEQUENCE, 4, 39),
    ] {
        let packed = bytes(hex);
        for length in 0..packed.len() {
            assert!(unpack(&packed[..length], mode, "NONE", stride, count).is_err());
        }
        let mut wrong = packed.clone();
        wrong[0] = 0x12;
        let wrong = unpack(&wrong, mode, "NONE", stride, count);
        assert_eq!(wrong, Err(MeshoptError::Header(0x12)));
        let mut longer = packed.clone();
        longer.insert(packed.len() - 34.min(packed.len() - 5), 0);
        assert!(unpack(&longer, mode, "NONE", stride, count).is_err());
        // Refused before memory is set aside.
        assert!(
            truncated(unpack(&packed, mode, "NONE", stride, 3 << 60))
                || u64::MAX / stride < 3 << 60
        );
        assert!(truncated(unpack(&packed, mode, "NONE", stride, 3 << 30)));
        assert!(unpack(&packed, mode, "NONE", 3, count).is_err());
        assert!(unpack(&packed, mode, "QUATERNION", 4, count).is_err());
        assert_eq!(
            unpack(&packed, "POINTS", "NONE", stride, count),
            Err(MeshoptError::Mode)
        );
    }
}

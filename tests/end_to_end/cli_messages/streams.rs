//! Where results go: a full device, a reader that has gone away, a limit on the size of files.

use super::{folder, run, stderr};
use std::fs::{self, OpenOptions};
use std::path::Path;
use std::process::{Command, Stdio};

const TETRAHEDRON: &str =
    "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1");
    command
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_written_are_an_error() {
    let folder = folder();
    fs::write(folder.path().join("a.obj"), TETRAHEDRON).expect("written");
    let all: [&[&str]; 5] = [
        &["schema", "config"],
        &["check", "a.obj"],
        &["init"],
        &["--help"],
        &["build", "--help"],
    ];
    for arguments in all {
        let full = OpenOptions::new().write(true).open("/dev/full");
        let output = command(folder.path(), arguments)
            .stdout(full.expect("a full device"))
            .stderr(Stdio::piped())
            .output()
            .expect("the command starts");
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(
            said.contains("standard output cannot be written: No space left"),
            "{arguments:?}: {said}"
        );
    }
}

#[cfg(unix)]
#[test]
fn a_reader_that_has_gone_away_is_no_error() {
    let folder = folder();
    let mut child = command(folder.path(), &["schema", "config"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(
        (output.status.code(), stderr(&output).as_str()),
        (Some(0), "")
    );
}

/// The system ends a process whose file grows beyond its limit: that is as if the disk were full.
#[cfg(unix)]
#[test]
fn a_file_that_may_not_grow_is_no_mistake_of_the_program() {
    let folder = folder();
    fs::write(folder.path().join("a.obj"), TETRAHEDRON).expect("written");
    let arguments = ["build", "a.obj", "--set", "patches.texel_budget=65536"];
    let inner = command(folder.path(), &arguments);
    let output = Command::new("sh")
        .args(["-c", "ulimit -f 40; exec \"$0\" \"$@\""])
        .arg(inner.get_program())
        .args(inner.get_args())
        .current_dir(folder.path())
        .env("NO_COLOR", "1")
        .output()
        .expect("the shell starts");
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.contains("(output)") && said.contains("ulimit -f"),
        "{said}"
    );
    assert!(!said.contains("internal"), "{said}");
}

/// On systems whose names are bytes.
#[cfg(target_os = "linux")]
#[test]
fn a_name_that_is_no_unicode_works_or_is_refused_in_words() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let name = OsStr::from_bytes(b"m\xffsh.obj");
    let cube = "fixtures/good/genus-0-cube.obj";
    fs::copy(cube, folder.path().join(name)).expect("copied");
    let cheap = [
        "--set",
        "images.domain=grid",
        "--set",
        "grid.cells=24",
        "--set",
        "pictures.enabled=false",
    ];
    let config = OsStr::from_bytes(b"c\xff.toml");
    fs::write(folder.path().join(config), "").expect("written");
    let pattern = OsStr::from_bytes(b"p\xff.png");
    fs::copy("fixtures/patterns/waves.png", folder.path().join(pattern)).expect("copied");
    let out = OsStr::from_bytes(b"o\xfft");
    let glb = OsStr::from_bytes(b"r\xff.glb");
    let os = OsStr::new;
    let inside = Path::new(out).join("m-sh");
    let inside = inside.as_os_str();
    let listed = OsStr::from_bytes(b"l\xff.txt");
    fs::write(folder.path().join(listed), "other.obj\n").expect("written");
    fs::write(folder.path().join("other.obj"), TETRAHEDRON).expect("written");
    let mut at_listed = b"@".to_vec();
    at_listed.extend(listed.as_bytes());
    let at_listed = OsStr::from_bytes(&at_listed);
    let cases: [(&[&OsStr], i32, &str); 13] = [
        (&[os("check"), name], 0, ""),
        (&[os("build"), name, os("--out"), out], 0, ""),
        (&[os("build"), config, name, os("--out"), out], 0, ""),
        (&[os("build"), at_listed], 0, ""),
        (&[os("verify"), out], 0, ""),
        (&[os("verify"), inside], 0, ""),
        (&[os("rebuild"), inside, os("--out"), glb], 0, ""),
        (
            &[
                os("texture"),
                inside,
                os("--pattern"),
                pattern,
                os("--out"),
                OsStr::from_bytes(b"t\xff"),
            ],
            0,
            "",
        ),
        (&[os("explain"), inside], 0, ""),
        (
            &[os("cones"), name, os("--out"), OsStr::from_bytes(b"k\xff")],
            1,
            "no Unicode text",
        ),
        (&[os("fit"), inside], 0, ""),
        (
            &[os("plan"), name, os("--out"), out, os("-p"), os("p.jsonl")],
            2,
            "no Unicode",
        ),
        (&[os("init"), OsStr::from_bytes(b"i\xff.toml")], 0, ""),
    ];
    for (arguments, code, words) in cases {
        let mut command = command(folder.path(), &[]);
        command.args(arguments);
        if matches!(arguments[0].to_str(), Some("build" | "cones" | "plan")) {
            command.args(cheap);
        }
        let output = command.output().expect("the command starts");
        let said = stderr(&output);
        let shown = format!("{arguments:?}: {said}");
        assert_eq!(output.status.code(), Some(code), "{shown}");
        assert!(
            said.contains(words) && !said.contains("internal"),
            "{shown}"
        );
    }
}

/// A pipe would be waited for, and a device gives bytes without end.
#[cfg(target_os = "linux")]
#[test]
fn inputs_that_are_no_regular_files_are_refused() {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    let folder = folder();
    let place = folder.path();
    fs::write(place.join("a.obj"), TETRAHEDRON).expect("written");
    fs::write(
        place.join("cones.toml"),
        "[cones]\nstrategy = \"file\"\nfile = \"cones.txt\"\n",
    )
    .expect("written");
    let built = [
        "build",
        "a.obj",
        "--set",
        "patches.texel_budget=4096",
        "--set",
        "pictures.enabled=false",
    ];
    let output = run(place, &built);
    assert!(output.status.success(), "{}", stderr(&output));
    let names = [
        "m.obj",
        "m.gltf",
        "c.toml",
        "cones.txt",
        "p.png",
        "l.txt",
        "p.jsonl",
    ];
    let all: [&[&str]; 9] = [
        &["check", "m.obj"],
        &["check", "m.gltf"],
        &["build", "m.obj"],
        &["build", "c.toml"],
        &["build", "cones.toml", "a.obj"],
        &["texture", "affine-atlas-out/a", "--pattern", "p.png"],
        &["build", "@l.txt"],
        &["run", "-p", "p.jsonl"],
        &["cones", "m.obj"],
    ];
    for device in [false, true] {
        for name in names {
            let path = place.join(name);
            let _ = fs::remove_file(&path);
            match device {
                true => std::os::unix::fs::symlink("/dev/zero", &path).expect("a link"),
                false => {
                    mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe")
                }
            }
        }
        for arguments in all {
            // A limit for the case that it would be read after all.
            let output = limited(place, arguments);
            let said = stderr(&output);
            let code = output.status.code();
            assert!(
                matches!(code, Some(1..=3)),
                "{arguments:?}: {code:?} {said}"
            );
            assert!(!said.contains("internal"), "{arguments:?}: {said}");
        }
    }
}

/// Runs the command with a gigabyte, a minute of processor time, and two minutes in all.
#[cfg(target_os = "linux")]
fn limited(folder: &Path, arguments: &[&str]) -> std::process::Output {
    let inner = command(folder, arguments);
    Command::new("timeout")
        .args([
            "120",
            "sh",
            "-c",
            "ulimit -d 1000000 -t 60; exec \"$0\" \"$@\"",
        ])
        .arg(inner.get_program())
        .args(inner.get_args())
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .output()
        .expect("the shell starts")
}

/// Files of less than a megabyte that stand for much more.
#[cfg(target_os = "linux")]
#[test]
fn no_small_file_costs_a_gigabyte_or_a_minute_to_read() {
    let folder = folder();
    let place = folder.path();
    let square = |accessors: &str, attributes: &str, indices: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":72,"uri":"data:;base64,AACAPwAAgD8AAIA/AACAPwAAgL8AAIC/AACAvwAAgD8AAIC/AACAvwAAgL8AAIA/AAABAAIAAAACAAMAAAADAAEAAQADAAIA"}}],"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},{{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}},{accessors}],"meshes":[{{"primitives":[{{"attributes":{{{attributes}}},"indices":{indices}}}]}}],"nodes":[{{"mesh":0}}]}}"#
        )
    };
    let many = |count: usize, accessor: usize| {
        let each = (0..count).map(|i| format!("\"_{i:x}\":{accessor}"));
        each.collect::<Vec<_>>().join(",")
    };
    let position = r#""POSITION":0"#;
    let zeros = |component: u32, count: u64, kind: &str| {
        format!(r#"{{"componentType":{component},"count":{count},"type":"{kind}"}}"#)
    };
    let indices = |count| square(&zeros(5125, count, "SCALAR"), position, "2");
    let vertices = |count| square(&zeros(5126, count, "VEC3"), r#""POSITION":2"#, "1");
    let both = |count, attributes| {
        let accessors = [zeros(5126, count, "VEC3"), zeros(5126, count, "SCALAR")].join(",");
        let attributes = format!("\"POSITION\":2,{}", many(attributes, 3));
        square(&accessors, &attributes, "1")
    };
    let mut fan = String::from("v 0 0 0\n");
    fan.push_str(&"v 1 0 0\n".repeat(3));
    let polygon = format!("{fan}f{}\n", " 1 2 3".repeat(150_000));
    let mut properties = b"ply\nformat binary_little_endian 1.0\nelement vertex 4\n".to_vec();
    for name in ["x", "y", "z"] {
        properties.extend(format!("property float {name}\n").bytes());
    }
    for i in 0..1000 {
        properties.extend(format!("property uchar p{i}\n").bytes());
    }
    properties.extend(b"element face 1\nproperty list uint uchar vertex_indices\nend_header\n");
    properties.resize(properties.len() + 4 * 1012, 0);
    properties.extend(900_000u32.to_le_bytes());
    properties.resize(properties.len() + 900_000, 1);
    let all: [(&str, Vec<u8>); 12] = [
        ("indices-small.gltf", indices(6_000_000).into()),
        ("indices.gltf", indices(300_000_000).into()),
        ("indices-huge.gltf", indices(u64::MAX).into()),
        ("vertices-small.gltf", vertices(2_700_000).into()),
        ("vertices.gltf", vertices(50_000_000).into()),
        ("attributes-few-values.gltf", square(&zeros(5126, 4, "SCALAR"), &format!("{position},{}", many(90_000, 2)), "1").into()),
        ("attributes.gltf", both(1_000_000, 8_000).into()),
        ("attributes-100k.gltf", both(100_000, 8_000).into()),
        ("sparse.gltf", square(r#"{"componentType":5126,"count":40000000,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":0}}}"#, r#""POSITION":2"#, "1").into()),
        ("polygon.obj", polygon.into()),
        ("properties.ply", properties),
        ("materials.gltf", square(&zeros(5126, 4, "SCALAR"), position, "1").replace("\"nodes\"", &format!("\"materials\":[{}{{}}],\"nodes\"", "{},".repeat(300_000))).into()),
    ];
    for (name, bytes) in all {
        assert!(bytes.len() < 1 << 20, "{name}: {} bytes", bytes.len());
        fs::write(place.join(name), bytes).expect("written");
        let output = limited(place, &["check", name]);
        let said = stderr(&output);
        let code = output.status.code();
        // Good, or refused in words; not ended by a limit.
        assert!(matches!(code, Some(0 | 1)), "{name}: {code:?} {said}");
        assert!(!said.contains("internal"), "{name}: {said}");
        fs::remove_file(place.join(name)).expect("removed");
    }
}

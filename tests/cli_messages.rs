//! The command as a user meets it: files it writes, messages, exit codes.

use std::path::Path;
use std::process::{Command, Output};

/// Runs the command in a folder, as if its output went to a file.
fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_affine-atlas"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("RUST_BACKTRACE")
        .env_remove("COLUMNS")
        .env("NO_COLOR", "1")
        .output()
        .expect("the command starts")
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// The message of a refusal, which must leave with the given exit code and print no result.
fn refusal(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
    assert_eq!(stdout(&output), "");
    // insta ignores surrounding empty lines but not trailing spaces.
    stderr(&output)
        .lines()
        .map(|line| format!("{}\n", line.trim_end()))
        .collect()
}

/// The refusal of a configuration of this text.
fn config_refusal(text: &str) -> String {
    let folder = folder();
    std::fs::write(folder.path().join("config.toml"), text).expect("written");
    refusal(folder.path(), &["build"], 2)
}

#[test]
fn init_writes_the_commented_configuration_once() {
    let folder = folder();
    let output = run(folder.path(), &["init"]);
    assert!(output.status.success(), "{}", stderr(&output));
    insta::assert_snapshot!(stdout(&output), @r"
    wrote config.toml
    list your meshes in `input.paths`, then run: affine-atlas build config.toml
    ");
    let file = folder.path().join("config.toml");
    let text = std::fs::read_to_string(&file).expect("written");
    assert_eq!(text, include_str!("../config.toml"));

    std::fs::write(&file, "# mine").expect("written");
    insta::assert_snapshot!(refusal(folder.path(), &["init"], 2), @r"
    error: config.toml exists already
    help: choose another name, or replace it with `--force`
    ");
    assert_eq!(
        std::fs::read_to_string(&file).expect("still there"),
        "# mine"
    );

    assert!(
        run(folder.path(), &["init", "--force", "--quiet"])
            .status
            .success()
    );
    assert_eq!(std::fs::read_to_string(&file).expect("replaced"), text);
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("a folder")
        .collect();
    assert_eq!(left.len(), 1, "a temporary file stayed behind");
}

#[cfg(unix)]
#[test]
fn init_writes_an_ordinary_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    assert!(run(folder.path(), &["init"]).status.success());
    let plain = folder.path().join("plain");
    std::fs::write(&plain, "").expect("written");
    let mode = |path: &Path| {
        std::fs::metadata(path)
            .expect("exists")
            .permissions()
            .mode()
    };
    assert_eq!(mode(&folder.path().join("config.toml")), mode(&plain));
}

#[test]
fn init_into_a_missing_folder() {
    let folder = folder();
    insta::assert_snapshot!(refusal(folder.path(), &["init", "no/such/my.toml"], 2), @r"
    error: no/such/my.toml cannot be written: there is no folder no/such
    help: check that its folder exists, may be written and has space left
    ");
}

#[test]
fn no_configuration() {
    let folder = folder();
    insta::assert_snapshot!(refusal(folder.path(), &["build"], 2), @r"
    error: there is no configuration file config.toml
    help: write one with `affine-atlas init`, or name a mesh file instead: `affine-atlas build MESH
          --out FOLDER`
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["check", "other.toml"], 2), @r"
    error: there is no configuration file other.toml
    help: write one with `affine-atlas init`, or name a mesh file instead: `affine-atlas build MESH
          --out FOLDER`
    ");
}

#[test]
fn two_configurations() {
    let folder = folder();
    insta::assert_snapshot!(refusal(folder.path(), &["build", "a.toml", "b.toml"], 2), @r"
    error: two configurations are named, a.toml and b.toml
    help: name one; single keys can be changed with `--set key=value`
    ");
}

#[test]
fn nothing_to_build() {
    let folder = folder();
    std::fs::write(folder.path().join("config.toml"), "").expect("written");
    insta::assert_snapshot!(refusal(folder.path(), &["build"], 3), @r"
    error: no mesh is named: `input.paths` is empty
    help: name a mesh: `affine-atlas build MESH`, or list meshes in `input.paths`
    ");
}

#[test]
fn output_over_input() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("spot")).expect("created");
    std::fs::write(folder.path().join("spot/spot.obj"), "v 0 0 0").expect("written");
    insta::assert_snapshot!(refusal(folder.path(), &["build", "spot/spot.obj", "--out", "."], 2), @r"
    error: the output folder ./spot of this run would replace the folder of its input spot/spot.obj
    help: choose another folder with `--out`
    ");
    assert!(folder.path().join("spot/spot.obj").exists());
}

#[test]
fn unknown_key() {
    insta::assert_snapshot!(config_refusal("# my settings\n[flow]\nshceme = \"thurston\"\n"), @r#"
     error: unknown key `flow.shceme`
      ,-[config.toml:3:1]
    2 | [flow]
    3 | shceme = "thurston"
      : ^^^^^^
      `----
     help: did you mean `flow.scheme`?
    "#);
}

#[test]
fn unknown_section() {
    insta::assert_snapshot!(config_refusal("[patch]\npadding = 2\n"), @r"
     error: unknown section `patch`
      ,-[config.toml:1:2]
    1 | [patch]
      :  ^^^^^
    2 | padding = 2
      `----
     help: did you mean `patches`?
    ");
}

#[test]
fn unknown_key_like_no_other() {
    insta::assert_snapshot!(config_refusal("[run]\nwallpaper = 2\n"), @r"
     error: unknown key `run.wallpaper`
      ,-[config.toml:2:1]
    1 | [run]
    2 | wallpaper = 2
      : ^^^^^^^^^
      `----
     help: known here: `run.threads`
    ");
}

#[test]
fn unknown_choice() {
    insta::assert_snapshot!(config_refusal("[flow]\nscheme = \"inversive\"\n"), @r#"
     error: `flow.scheme` has no choice "inversive"
      ,-[config.toml:2:10]
    1 | [flow]
    2 | scheme = "inversive"
      :          ^^^^^^^^^^^
      `----
     help: did you mean "inversive-distance"? Allowed: "vertex-scaling", "tangential", "thurston" or
           "inversive-distance"
    "#);
}

#[test]
fn wrong_type() {
    insta::assert_snapshot!(config_refusal("[patches]\ntexel_budget = \"512x512\"\n"), @r#"
     error: `patches.texel_budget` takes an integer from 4096 to 1073741824, but was given the text
     | "512x512"
      ,-[config.toml:2:16]
    1 | [patches]
    2 | texel_budget = "512x512"
      :                ^^^^^^^^^
      `----
     help: `patches.texel_budget`: an integer from 4096 to 1073741824, in texels; default 262144
    "#);
}

#[test]
fn out_of_range() {
    insta::assert_snapshot!(config_refusal("[connectivity]\nrings = 4\n"), @r"
     error: `connectivity.rings` takes an integer from 0 to 3, but was given 4
      ,-[config.toml:2:9]
    1 | [connectivity]
    2 | rings = 4
      :         ^
      `----
     help: `connectivity.rings`: an integer from 0 to 3, in rings; default 2
    ");
}

#[test]
fn no_toml() {
    insta::assert_snapshot!(config_refusal("[flow]\nscheme = thurston\n"), @r"
     error: not valid TOML: the word thurston is no value; only true and false stand without quotes
      ,-[config.toml:2:10]
    1 | [flow]
    2 | scheme = thurston
      :          ^^^^^^^^
      `----
     help: texts need quotes, lists need [ ], and each key stands once, on its own line
    ");
}

#[test]
fn missing_field_of_a_cone() {
    insta::assert_snapshot!(config_refusal("[cones]\nlist = [\n  { vertex = 3 },\n]\n"), @r#"
     error: `cones.list` is not usable: missing field `curvature`
      ,-[config.toml:3:3]
    2 | list = [
    3 |   { vertex = 3 },
      :   ^^^^^^^^^^^^^^
    4 | ]
      `----
     help: `cones.list`: a list of tables such as [{ vertex = 0, curvature = "1/2" }]; default []
    "#);
}

#[test]
fn bad_overrides() {
    let folder = folder();
    let set = |text: &str| refusal(folder.path(), &["build", "a.obj", "--set", text], 2);
    insta::assert_snapshot!(set("flow.curvature_tolerence=1e-8"), @r"
     error: unknown key `flow.curvature_tolerence`
      ,-[--set:1:6]
    1 | flow.curvature_tolerence = 1e-8
      :      ^^^^^^^^^^^^^^^^^^^
      `----
     help: did you mean `flow.curvature_tolerance`?
    ");
    insta::assert_snapshot!(set("flow.scheme=tangental"), @r#"
     error: `flow.scheme` has no choice "tangental"
      ,-[--set:1:15]
    1 | flow.scheme = "tangental"
      :               ^^^^^^^^^^^
      `----
     help: did you mean "tangential"? Allowed: "vertex-scaling", "tangential", "thurston" or
           "inversive-distance"
    "#);
    insta::assert_snapshot!(set("flow.scheme"), @r"
    error: `--set flow.scheme` gives no value
    help: write `--set section.key=value`, for example `--set flow.scheme=thurston`
    ");
}

#[test]
fn errors_as_json_lines() {
    let folder = folder();
    let text = refusal(
        folder.path(),
        &["build", "--log-format", "json", "--quiet"],
        2,
    );
    let line: serde_json::Value = serde_json::from_str(text.trim()).expect("one JSON object");
    assert_eq!(line["level"], "ERROR");
    assert_eq!(line["exit_code"], 2);
    assert_eq!(
        line["message"],
        "there is no configuration file config.toml"
    );
    assert!(
        line["remedy"]
            .as_str()
            .expect("a remedy")
            .contains("affine-atlas init")
    );
}

#[test]
fn verify_without_a_folder() {
    let folder = folder();
    insta::assert_snapshot!(refusal(folder.path(), &["verify", "nowhere"], 2), @r"
    error: there is no folder nowhere
    help: name a folder that `affine-atlas build` wrote
    ");
}

#[test]
fn wrong_arguments_exit_with_2_and_help_with_0() {
    let folder = folder();
    for arguments in [
        &[][..],
        &["bild"],
        &["build", "--thread", "x"],
        &["build", "--threads", "1025"],
        &["verify"],
        &["build", "-q", "-v"],
    ] {
        assert_eq!(
            run(folder.path(), arguments).status.code(),
            Some(2),
            "{arguments:?}"
        );
    }
    for arguments in [
        &["--help"][..],
        &["--version"],
        &["build", "--help"],
        &["help", "verify"],
    ] {
        assert_eq!(
            run(folder.path(), arguments).status.code(),
            Some(0),
            "{arguments:?}"
        );
    }
}

#[test]
fn help() {
    let folder = folder();
    insta::assert_snapshot!(stdout(&run(folder.path(), &["-h"])), @r"
    Turns triangle meshes into affine atlases

    Usage: affine-atlas [OPTIONS] <COMMAND>

    Commands:
      build   Build an atlas of each mesh
      check   Say what a build would do, and build nothing
      verify  Read atlases back and check every property they must have
      init    Write a configuration file that explains every key
      help    Print this message or the help of the given subcommand(s)

    Options:
      -q, --quiet                Show errors only
      -v, --verbose...           Show each step; twice: everything
          --log-format <FORMAT>  Progress and errors as text, or as one JSON object a line (both on
                                 standard error) [default: text] [possible values: text, json]
          --threads <N>          Threads to use; 0 takes one for each core [default: run.threads of the
                                 configuration]
      -h, --help                 Print help (see more with '--help')
      -V, --version              Print version

    Exit codes:
        0  all good
        1  some meshes (or checks) failed
        2  wrong arguments or configuration
        3  nothing to do
        4  an error of this program
      130  stopped by Ctrl-C
    ");
    insta::assert_snapshot!(stdout(&run(folder.path(), &["build", "-h"])), @r"
    Build an atlas of each mesh

    Usage: affine-atlas build [OPTIONS] [CONFIG|MESH]...

    Arguments:
      [CONFIG|MESH]...  A configuration (ends in .toml), meshes (glTF, GLB, OBJ, PLY, STL, OFF), or
                        both: meshes then take the place of `input.paths` [default: config.toml]

    Options:
          --set <KEY=VALUE>      Set a key of the configuration, for example `flow.scheme=thurston`; may
                                 be repeated
      -o, --out <DIR>            Folder for the atlases [default: output.folder of the configuration, or
                                 affine-atlas-out]
      -q, --quiet                Show errors only
      -v, --verbose...           Show each step; twice: everything
          --log-format <FORMAT>  Progress and errors as text, or as one JSON object a line (both on
                                 standard error) [default: text] [possible values: text, json]
          --threads <N>          Threads to use; 0 takes one for each core [default: run.threads of the
                                 configuration]
      -h, --help                 Print help (see more with '--help')

    Examples:
      affine-atlas build                              what ./config.toml says
      affine-atlas build bunny.obj --out atlases      one mesh, default settings
      affine-atlas build bunny.obj --set cones.strategy=spread --set cones.count=6
      affine-atlas build my.toml bunny.obj            settings of my.toml, another mesh

    Each mesh becomes a folder OUT/NAME with atlas.json, atlas.npz, surface.glb, images/ and pictures.
    It appears when it is complete; an older good folder stays if the build fails.
    ");
}

/// Every command's help shows an example of it.
#[test]
fn help_has_examples() {
    let folder = folder();
    for command in ["build", "check", "verify", "init"] {
        for flag in ["-h", "--help"] {
            let text = stdout(&run(folder.path(), &[command, flag]));
            assert!(
                text.contains(&format!("\n  affine-atlas {command} ")),
                "{text}"
            );
        }
    }
}

/// A mesh that cannot be read is that mesh's failure, not one of the command.
#[test]
fn a_missing_mesh_fails_its_asset() {
    let folder = folder();
    let output = run(folder.path(), &["build", "missing.obj", "--out", "out"]);
    assert!(
        stdout(&output).contains("missing  failed"),
        "{}",
        stdout(&output)
    );
    assert!(
        stderr(&output).contains("failed: missing"),
        "{}",
        stderr(&output)
    );
    let json = run(
        folder.path(),
        &[
            "build",
            "missing.obj",
            "--out",
            "out",
            "--quiet",
            "--log-format",
            "json",
        ],
    );
    let line: serde_json::Value = serde_json::from_str(&stderr(&json)).expect("one JSON object");
    assert_eq!(
        (&line["level"], &line["asset"]),
        (&"ERROR".into(), &"missing".into())
    );
    let quiet = run(
        folder.path(),
        &["build", "missing.obj", "--out", "out", "--quiet"],
    );
    assert_eq!(stdout(&quiet), "");
    assert_eq!(quiet.status.code(), output.status.code());
}

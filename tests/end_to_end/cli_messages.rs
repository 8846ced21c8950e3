//! The command as a user meets it: files it writes, messages, exit codes.

use std::path::Path;
use std::process::{Command, Output};

mod plans;

mod streams;

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
    wrote config.toml for all meshes in and below its folder, of which there are none yet
    put meshes there or name them in `input.paths`, then run: affine-atlas build
    ");
    let file = folder.path().join("config.toml");
    let text = std::fs::read_to_string(&file).expect("written");
    assert_eq!(
        text,
        affine_atlas::config::commented_for_its_folder(),
        "what is written is not what is tested"
    );

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

/// What `init` writes builds what lies in its folder, one mesh or several, and says so.
#[test]
fn init_then_build_where_meshes_are() {
    let folder = folder();
    let place = |name: &str| folder.path().join(name);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let cube = fixtures.join("good/genus-0-cube.obj");
    std::fs::create_dir(place("project")).expect("a folder");
    std::fs::copy(&cube, place("project/cube.obj")).expect("copied");
    let inside = place("project");
    let said = stdout(&run(&inside, &["init"]));
    insta::assert_snapshot!(said, @r"
    wrote config.toml for cube.obj
    next: affine-atlas build
    ");
    let built = |id: &str| {
        place("project/affine-atlas-out")
            .join(id)
            .join("atlas.json")
    };
    let output = run(&inside, &["build", "--set", "pictures.enabled=false"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(built("cube").is_file(), "{}", stderr(&output));

    // From above, with one more mesh; what was built is no mesh of the folder.
    std::fs::create_dir(place("project/more")).expect("a folder");
    std::fs::copy(&cube, place("project/more/box.obj")).expect("copied");
    let said = stdout(&run(folder.path(), &["init", "project", "--force"]));
    insta::assert_snapshot!(said, @r"
    wrote project/config.toml for the 2 meshes in and below its folder
    next: affine-atlas build project/config.toml
    ");
    let again = [
        "build",
        "project/config.toml",
        "--set",
        "pictures.enabled=false",
    ];
    let output = run(folder.path(), &again);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(built("more-box").is_file(), "{}", stderr(&output));
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
     help: known here: `run.jobs`, `run.threads`, `run.timeout`, `run.memory`, `run.total_memory`
    ");
}

#[test]
fn a_section_below_another() {
    insta::assert_snapshot!(config_refusal("[run]\nthreads = 2\ngrid.cells = 3\n"), @r"
     error: unknown key `run.grid`
      ,-[config.toml:3:1]
    2 | threads = 2
    3 | grid.cells = 3
      : ^^^^
      `----
     help: `grid` is a section of its own: write `[grid]` on a line before its keys
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
fn unknown_preset() {
    insta::assert_snapshot!(config_refusal("preset = \"best\"\n"), @r#"
     error: `preset` has no choice "best"
      ,-[config.toml:1:10]
    1 | preset = "best"
      :          ^^^^^^
      `----
     help: allowed: "spline-fit", "geometry-image-256", "omage-1024" or "texture"
    "#);
}

#[test]
fn rectangles() {
    let text = "[images]\ndomain = \"rectangle\"\n";
    insta::assert_snapshot!(config_refusal(text), @r#"
     error: `images.domain` is not "rectangle" any more: images.domain = "grid" samples rectangles of
     | one grid on the whole surface, whose sides hold the same points
      ,-[config.toml:2:10]
    1 | [images]
    2 | domain = "rectangle"
      :          ^^^^^^^^^^^
      `----
     help: remove `images.domain`
    "#);
}

#[test]
fn packed_blocks() {
    let text = "preset = \"omage-1024\"\n[images]\ndomain = \"grid\"\n";
    insta::assert_snapshot!(config_refusal(text), @r#"
     error: `patches.texel_budget` is for flat patches, but `images.domain` is "grid"
     help: leave `patches.texel_budget` out, or set `images.domain = "flat"`
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
fn rebuild_without_a_folder_or_a_glb() {
    let folder = folder();
    insta::assert_snapshot!(refusal(folder.path(), &["rebuild", "nowhere", "-o", "a.glb"], 2), @r"
    error: there is no folder nowhere
    help: name a folder that `affine-atlas build` wrote
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["rebuild", ".", "-o", "a.obj"], 2), @r"
    error: a.obj does not end in .glb, the only format that meshes are written in
    help: name the file with `--out MESH.glb`
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["rebuild", ".", "-o", "a.glb"], 1), @"failed: . (input): . holds no atlas.json and no component-000; give the folder that `affine-atlas build` wrote for a mesh");
}

#[test]
fn fit_without_a_mesh_or_a_name() {
    let folder = folder();
    insta::assert_snapshot!(refusal(folder.path(), &["fit", "nowhere.obj"], 1), @r"
    [1/1] nowhere: read
    failed: nowhere.obj (input): nowhere.obj: cannot be read (it does not exist); check that the file exists and that you may read it
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["fit", ".", "-o", ".."], 2), @r"
    error: .. does not end in the name of a folder to write
    help: name it with `--out FOLDER`
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["fit", ".", "--tolerance", "1.5"], 2), @r"
    error: invalid value '1.5' for '--tolerance <DISTANCE>': it must be a part of the diagonal below 1, such as 0.001, or a length such as 0.1mm (mm, cm, m, in)

    For more information, try '--help'.
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["fit", ".", "--angle", "0"], 2), @r"
    error: invalid value '0' for '--angle <DEGREES>': it must be a number from 0.001 to 90

    For more information, try '--help'.
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["fit", ".", "--unit", "furlong"], 2), @r"
    error: invalid value 'furlong' for '--unit <UNIT>': it must be mm, cm, m or in

    For more information, try '--help'.
    ");
    std::fs::create_dir(folder.path().join("empty")).expect("created");
    insta::assert_snapshot!(refusal(folder.path(), &["fit", "empty"], 1), @"failed: empty (input): empty holds no atlas.json and no component-000; give the folder that `affine-atlas build` wrote for a mesh");
}

#[test]
fn texture_without_a_folder_or_a_pattern() {
    let folder = folder();
    let texture = |arguments: &[&str], code: i32| {
        let all = [&["texture"], arguments].concat();
        refusal(folder.path(), &all, code)
    };
    insta::assert_snapshot!(texture(&["nowhere", "-p", "a.png"], 2), @r"
    error: there is no folder nowhere
    help: name a folder that `affine-atlas build` wrote
    ");
    insta::assert_snapshot!(texture(&[".", "-p", "a.png", "-o", ".."], 2), @r"
    error: .. does not end in the name of a folder to write
    help: name it with `--out FOLDER`
    ");
    insta::assert_snapshot!(texture(&[".", "-p", "a.png", "--tiles", "65"], 2), @r"
    error: invalid value '65' for '--tiles <N>': 65 is not in 1..=64

    For more information, try '--help'.
    ");
    insta::assert_snapshot!(texture(&[".", "-p", "a.png", "--size", "0"], 2), @r"
    error: invalid value '0' for '--size <N>': 0 is not in 16..=8192

    For more information, try '--help'.
    ");
    std::fs::create_dir(folder.path().join("empty")).expect("created");
    insta::assert_snapshot!(texture(&["empty", "-p", "a.png"], 1), @"failed: empty (input): empty holds no atlas.json and no component-000; give the folder that `affine-atlas build` wrote for a mesh");
    // The pattern is read before the atlas.
    std::fs::create_dir(folder.path().join("atlas")).expect("created");
    std::fs::write(folder.path().join("atlas/atlas.json"), "{}").expect("written");
    insta::assert_snapshot!(texture(&["atlas", "-p", "a.png"], 1), @"failed: atlas (input): the pattern a.png cannot be read: No such file or directory (os error 2); give a PNG or JPEG file that is there");
    insta::assert_snapshot!(texture(&["atlas", "-p", "empty"], 1), @"failed: atlas (input): the pattern empty cannot be read: it is no regular file; give a PNG or JPEG file that is there");
    std::fs::write(folder.path().join("a.png"), "no image").expect("written");
    insta::assert_snapshot!(texture(&["atlas", "-p", "a.png"], 1), @"failed: atlas (input): the pattern a.png is no image that can be read (Format error decoding Png: Invalid PNG signature.); give a PNG or JPEG file");
    std::fs::write(
        folder.path().join("a.png"),
        include_bytes!("../../fixtures/patterns/waves.png"),
    )
    .expect("written");
    insta::assert_snapshot!(texture(&["atlas", "-p", "a.png"], 1), @r#"failed: atlas (input): atlas/atlas.json says format "", version 0; this program reads "affine-atlas", versions 1 and 2"#);
    let head = r#"{"format": "affine-atlas", "version": 1, "patches": []}"#;
    std::fs::write(folder.path().join("atlas/atlas.json"), head).expect("written");
    insta::assert_snapshot!(texture(&["atlas", "-p", "a.png"], 1), @r#"failed: atlas (input): atlas/atlas.json has no grid: build with images.domain = "grid"; where that was set, no grid could be made, and the build's warning says why"#);
    let left = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(left, 3, "something was written");
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
        &["rebuild", "."],
        &["fit"],
        &["fit", ".", "--tolerance", "nan"],
        &["texture", "."],
        &["texture", ".", "-p", "a.png", "--tiles", "0"],
        &["texture", ".", "-p", "a.png", "--tiles", "1.5"],
        &["plan", "a.obj"],
        &["plan", "a.obj", "-p", "p", "--shards", "0"],
        &["run", "-p", "p", "--shard", "0/3"],
        &["merge"],
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
fn schema_and_explain_refuse_what_they_do_not_know() {
    let folder = folder();
    insta::assert_snapshot!(refusal(folder.path(), &["schema", "glb"], 2), @r"
    error: invalid value 'glb' for '<FILE>'
      [possible values: atlas, components, manifest, config, plan, fit]

    For more information, try '--help'.
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["explain", "nowhere/bunny"], 1), @"failed: nowhere/bunny (input): nowhere/bunny is neither a mesh nor a folder, and no manifest.jsonl beside it names it; give a mesh, or OUT/NAME of a build");
    insta::assert_snapshot!(refusal(folder.path(), &["explain", ".", "-o", "a.obj"], 2), @r"
    error: a.obj does not end in .glb, the only format that meshes are written in
    help: name the file with `--out MESH.glb`
    ");
    std::fs::create_dir(folder.path().join("empty")).expect("created");
    insta::assert_snapshot!(refusal(folder.path(), &["explain", "empty", "-o", "a.glb"], 1), @"failed: empty (input): empty holds no atlas.json and no component-000; give the folder that `affine-atlas build` wrote for a mesh");
    assert!(!folder.path().join("a.glb").exists());
}

#[test]
fn explain_names_and_shows_the_faces_at_fault() {
    let folder = folder();
    let strip = include_str!("../../fixtures/bad/moebius-strip.obj");
    std::fs::write(folder.path().join("strip.obj"), strip).expect("written");
    let output = run(folder.path(), &["explain", "strip.obj", "-o", "why.glb"]);
    assert_eq!(output.status.code(), Some(1));
    let said = stdout(&output);
    assert!(
        said.starts_with("fails (input): the component of "),
        "{said}"
    );
    assert!(said.contains("at 2 faces of the file: "), "{said}");
    assert!(said.ends_with("faces: written to why.glb\n"), "{said}");
    let bytes = std::fs::read(folder.path().join("why.glb")).expect("written");
    assert!(bytes.starts_with(b"glTF"));
}

#[test]
fn help() {
    let folder = folder();
    insta::assert_snapshot!(stdout(&run(folder.path(), &["-h"])), @r"
    Unwraps triangle meshes: conformal UVs, affine atlases, geometry images

    Usage: affine-atlas [OPTIONS] <COMMAND>

    Commands:
      build    Build an atlas of each mesh
      plan     Write down what a build would do, for several machines
      run      Build one shard of a plan
      merge    Put what all shards of a plan built together, as one build
      check    Say what a build would do, and build nothing
      cones    Show what more or fewer cones gain, and write lists of them
      verify   Read atlases back and check every property they must have
      rebuild  Make a mesh again from the geometry images of an atlas
      fit      Fit a smooth spline surface to a mesh: USD, STEP, G+Smo
      texture  Lay a repeating image over the whole surface as one texture
      explain  Say in plain words why an asset failed, or where it is distorted
      schema   Print a JSON schema of what is written, or of the configuration
      init     Write a configuration file that explains every key
      help     Print this message or the help of the given subcommand(s)

    Options:
      -q, --quiet                Show errors only
      -v, --verbose...           Show each step; twice: everything
          --log-format <FORMAT>  Progress and errors as text, or as one JSON object a line (both on
                                 standard error) [default: text] [possible values: text, json]
          --threads <N>          Threads to use, in `build` for each mesh; 0 takes one for each core,
                                 shared by the meshes that are built at the same time [default:
                                 run.threads of the configuration]
      -h, --help                 Print help (see more with '--help')
      -V, --version              Print version

    Exit codes:
        0  all good
        1  some meshes (or checks) failed
        2  wrong arguments or configuration
        3  nothing to do
        4  an error of this program
      130  stopped by Ctrl-C or SIGTERM
    ");
    insta::assert_snapshot!(stdout(&run(folder.path(), &["build", "-h"])), @r"
    Build an atlas of each mesh

    Usage: affine-atlas build [OPTIONS] [CONFIG|MESH]...

    Arguments:
      [CONFIG|MESH]...  A configuration (ends in .toml), meshes (glTF, GLB, OBJ, PLY, STL, OFF), or
                        both: meshes then take the place of `input.paths`. Folders, globs and `@LIST`, a
                        text file with one of all these a line, stand for the meshes that are found
                        [default: config.toml]

    Options:
          --set <KEY=VALUE>      Set a key of the configuration, for example `flow.scheme=thurston`; may
                                 be repeated
      -o, --out <DIR>            Folder for the atlases [default: output.folder of the configuration, or
                                 affine-atlas-out]
      -f, --force                Build also what is there, whole, and of the same mesh, settings and
                                 version
      -n, --dry-run              Say what would be built, and why, and build nothing
          --depfile <FILE>       Write for Make and Ninja which files OUT/manifest.jsonl was made from
          --profile <FILE>       Write where the time goes, as a trace that Perfetto (ui.perfetto.dev)
                                 opens
      -j, --jobs <N>             Meshes to build at the same time; 0 takes one for each core [default:
                                 run.jobs of the configuration]
      -q, --quiet                Show errors only
      -v, --verbose...           Show each step; twice: everything
          --log-format <FORMAT>  Progress and errors as text, or as one JSON object a line (both on
                                 standard error) [default: text] [possible values: text, json]
          --threads <N>          Threads to use, in `build` for each mesh; 0 takes one for each core,
                                 shared by the meshes that are built at the same time [default:
                                 run.threads of the configuration]
      -h, --help                 Print help (see more with '--help')

    Examples:
      affine-atlas build                              what ./config.toml says
      affine-atlas build bunny.obj --out atlases      one mesh, default settings
      affine-atlas build bunny.obj --set cones.strategy=spread --set cones.count=6
      affine-atlas build my.toml bunny.obj            settings of my.toml, another mesh
      affine-atlas build scans 'lib/**/*.glb' @extra.txt --out atlases
      affine-atlas build --dry-run                    what would be built, and why

    Each mesh becomes a folder OUT/NAME with atlas.json, atlas.npz, surface.glb, images/, pictures and
    report.html. It appears when it is complete; an older good folder stays if the build fails. Where
    mesh, settings and version are the same as last time and the folder is whole, nothing is built. OUT
    also gets manifest.jsonl and junit.xml (what became of each mesh), index.html (the same to look at)
    and logs/NAME.log. docs/output.md of the source describes every file, key and array.
    ");
    insta::assert_snapshot!(stdout(&run(folder.path(), &["plan", "-h"])), @r"
    Write down what a build would do, for several machines

    Usage: affine-atlas plan [OPTIONS] --plan <PLAN.jsonl> [CONFIG|MESH]...

    Arguments:
      [CONFIG|MESH]...  A configuration (ends in .toml), meshes (glTF, GLB, OBJ, PLY, STL, OFF), or
                        both: meshes then take the place of `input.paths`. Folders, globs and `@LIST`, a
                        text file with one of all these a line, stand for the meshes that are found
                        [default: config.toml]

    Options:
          --set <KEY=VALUE>      Set a key of the configuration, for example `flow.scheme=thurston`; may
                                 be repeated
      -o, --out <DIR>            Folder for the atlases [default: output.folder of the configuration, or
                                 affine-atlas-out]
      -f, --force                Build also what is there, whole, and of the same mesh, settings and
                                 version
          --shards <N>           Say how even so many shards would be
      -p, --plan <PLAN.jsonl>    File to write, replacing an older one
      -q, --quiet                Show errors only
      -v, --verbose...           Show each step; twice: everything
          --log-format <FORMAT>  Progress and errors as text, or as one JSON object a line (both on
                                 standard error) [default: text] [possible values: text, json]
          --threads <N>          Threads to use, in `build` for each mesh; 0 takes one for each core,
                                 shared by the meshes that are built at the same time [default:
                                 run.threads of the configuration]
      -h, --help                 Print help (see more with '--help')

    Examples:
      affine-atlas plan my.toml --out atlases --plan night.jsonl --shards 16
      affine-atlas run --plan night.jsonl --shard 1/16       to 16/16, on any machines, in any order
      affine-atlas merge --plan night.jsonl

    Machines need a common file system with the meshes and OUT, and the same version of this program.
    Relative paths start at the folder in which the plan is made: start all three there. Shards are of
    about the same expected time; how many there are is chosen with `run`, and --shards only shows what
    it comes to. The plan holds all settings: no configuration is read again.
    ");
    insta::assert_snapshot!(stdout(&run(folder.path(), &["run", "-h"])), @r"
    Build one shard of a plan

    Usage: affine-atlas run [OPTIONS] --plan <PLAN.jsonl>

    Options:
      -p, --plan <PLAN.jsonl>    File that `affine-atlas plan` wrote
      -s, --shard <I/N>          Which part, from 1, and of how many [default: 1/1]
      -j, --jobs <N>             Meshes to build at the same time; 0 takes one for each core [default:
                                 run.jobs of the configuration]
      -q, --quiet                Show errors only
      -v, --verbose...           Show each step; twice: everything
          --log-format <FORMAT>  Progress and errors as text, or as one JSON object a line (both on
                                 standard error) [default: text] [possible values: text, json]
          --threads <N>          Threads to use, in `build` for each mesh; 0 takes one for each core,
                                 shared by the meshes that are built at the same time [default:
                                 run.threads of the configuration]
      -h, --help                 Print help (see more with '--help')

    Examples:
      affine-atlas run --plan night.jsonl --shard 3/16
      affine-atlas run --plan night.jsonl --shard $SLURM_ARRAY_TASK_ID/20
      affine-atlas run --plan night.jsonl                    all of it

    May be run again at any time, after a kill or by an engine that is not sure: what this plan has
    built is not built again, and reported as before. A request to stop (SIGTERM, Ctrl-C) ends it within
    seconds. Exit codes are those of a build of these meshes; a shard without meshes is good.
    ");
    insta::assert_snapshot!(stdout(&run(folder.path(), &["merge", "-h"])), @r"
    Put what all shards of a plan built together, as one build

    Usage: affine-atlas merge [OPTIONS] --plan <PLAN.jsonl>

    Options:
      -p, --plan <PLAN.jsonl>    File that `affine-atlas plan` wrote
          --incomplete           Record meshes that are not done as cancelled instead of refusing
          --depfile <FILE>       Write for Make and Ninja which files OUT/manifest.jsonl was made from
      -q, --quiet                Show errors only
      -v, --verbose...           Show each step; twice: everything
          --log-format <FORMAT>  Progress and errors as text, or as one JSON object a line (both on
                                 standard error) [default: text] [possible values: text, json]
          --threads <N>          Threads to use, in `build` for each mesh; 0 takes one for each core,
                                 shared by the meshes that are built at the same time [default:
                                 run.threads of the configuration]
      -h, --help                 Print help (see more with '--help')

    Examples:
      affine-atlas merge --plan night.jsonl
      affine-atlas merge --plan night.jsonl --incomplete     also while some are not done

    Writes manifest.jsonl, junit.xml and index.html of OUT as one build of all meshes would have, and
    gives its exit code. Where a mesh is not done nothing is written, and the shards that it belongs to
    are named: exit code 1. With --incomplete it is recorded as cancelled: exit code 130.
    ");
    insta::assert_snapshot!(stdout(&run(folder.path(), &["cones", "-h"])), @r"
    Show what more or fewer cones gain, and write lists of them

    Usage: affine-atlas cones [OPTIONS] [CONFIG|MESH]...

    Arguments:
      [CONFIG|MESH]...  A configuration (ends in .toml), meshes (glTF, GLB, OBJ, PLY, STL, OFF), or
                        both: meshes then take the place of `input.paths`. Folders, globs and `@LIST`, a
                        text file with one of all these a line, stand for the meshes that are found
                        [default: config.toml]

    Options:
          --set <KEY=VALUE>      Set a key of the configuration, for example `flow.scheme=thurston`; may
                                 be repeated
      -o, --out <DIR>            Folder for the results [default: output.folder of the configuration, or
                                 affine-atlas-out]
          --counts <N,N,...>     Numbers of cones to try [default: 0,4,8,16,32, as far as the surface
                                 allows]
          --json                 Write one JSON array instead of tables
      -q, --quiet                Show errors only
      -v, --verbose...           Show each step; twice: everything
          --log-format <FORMAT>  Progress and errors as text, or as one JSON object a line (both on
                                 standard error) [default: text] [possible values: text, json]
          --threads <N>          Threads to use, in `build` for each mesh; 0 takes one for each core,
                                 shared by the meshes that are built at the same time [default:
                                 run.threads of the configuration]
      -h, --help                 Print help (see more with '--help')

    Examples:
      affine-atlas cones bunny.obj                    0, 4, 8, 16 and 32 cones, as far as possible
      affine-atlas cones bunny.obj --counts 6,12 --out trials
      affine-atlas cones bunny.obj --set cones.quantum=1/2
      affine-atlas build affine-atlas-out/bunny.cones/bunny.cones-8.toml

    Flattens the surface with each number of cones, chosen by the program, and shows area distortion
    (9), log scale u and length of the cut, beside those of equal cones far apart (of none, where the
    surface needs none). Each mesh gets a folder OUT/NAME.cones with, for each number N:
      NAME.cones-N.toml  a configuration that builds exactly this
      NAME.cones-N.txt   the same cones as two columns: vertex (from 0) and curvature in radians
      NAME.cones-N.png   the log scale before and after
    and cones.png (all in a row) and cones.json (the table). It appears when it is complete.
    ");
}

/// Every command's help shows an example of it.
#[test]
fn help_has_examples() {
    let folder = folder();
    for command in ["build", "check", "cones", "verify", "rebuild", "init"] {
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

const TETRAHEDRON: &str =
    "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";

/// A folder with a tetrahedron, a file of cones, and a configuration that names it.
fn cone_file(cones: &str, keys: &str) -> tempfile::TempDir {
    let folder = folder();
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("written");
    };
    write("tetra.obj", TETRAHEDRON);
    write("my.cones.txt", cones);
    write(
        "config.toml",
        &format!("[cones]\nfile = \"my.cones.txt\"\n{keys}"),
    );
    folder
}

fn cone_file_refusal(cones: &str, keys: &str, code: i32) -> String {
    let folder = cone_file(cones, keys);
    let text = refusal(
        folder.path(),
        &["build", "config.toml", "tetra.obj", "--quiet"],
        code,
    );
    assert!(!folder.path().join("affine-atlas-out/tetra").exists());
    text
}

#[test]
fn cone_files_that_are_no_lists_of_cones() {
    insta::assert_snapshot!(cone_file_refusal("0 1\n1\n", "", 2), @r"
     error: a line of cones.file must have 2 columns, a vertex and a curvature in radians, but this
     | has 1
      ,-[my.cones.txt:2:1]
    1 | 0 1
    2 | 1
      : ^
      `----
     help: each line holds the number of a vertex and its curvature in radians, for example `17
           1.570796`; `cones.file_first_vertex` says where numbers begin
    ");
    insta::assert_snapshot!(cone_file_refusal("# ears\nleft 1.5\n", "", 2), @r#"
     error: in cones.file a vertex is a whole number, but "left" is none
      ,-[my.cones.txt:2:1]
    1 | # ears
    2 | left 1.5
      : ^^^^
      `----
     help: each line holds the number of a vertex and its curvature in radians, for example `17
           1.570796`; `cones.file_first_vertex` says where numbers begin
    "#);
    insta::assert_snapshot!(cone_file_refusal("0 nan\n", "", 2), @r#"
     error: a curvature is a finite number of radians, but "nan" is none
      ,-[my.cones.txt:1:3]
    1 | 0 nan
      :   ^^^
      `----
     help: each line holds the number of a vertex and its curvature in radians, for example `17
           1.570796`; `cones.file_first_vertex` says where numbers begin
    "#);
    insta::assert_snapshot!(cone_file_refusal("0 1\n\n0 2\n", "", 2), @r"
     error: vertex 0 has a cone on line 1 already
      ,-[my.cones.txt:3:1]
    2 |
    3 | 0 2
      : ^
      `----
     help: each line holds the number of a vertex and its curvature in radians, for example `17
           1.570796`; `cones.file_first_vertex` says where numbers begin
    ");
    insta::assert_snapshot!(cone_file_refusal("0 1\n", "file_first_vertex = 1\n", 2), @r"
     error: the vertices of this file count from 1, but it names vertex 0: set
     | cones.file_first_vertex = 0 if they count from 0
      ,-[my.cones.txt:1:1]
    1 | 0 1
      : ^
      `----
     help: each line holds the number of a vertex and its curvature in radians, for example `17
           1.570796`; `cones.file_first_vertex` says where numbers begin
    ");
}

#[test]
fn cone_files_that_do_not_fit_the_mesh_or_the_keys() {
    let pi = "0 3.14159\n1 3.14159\n2 3.14159\n";
    insta::assert_snapshot!(cone_file_refusal(&format!("{pi}9 3.14159"), "", 1), @"failed: tetra (prescription): cones.file line 4 names vertex 9, but the file has 4 vertices (0 to 3): correct the index");
    insta::assert_snapshot!(cone_file_refusal("1 3.14\n5 3.14", "file_first_vertex = 1\n", 1), @"failed: tetra (prescription): cones.file line 2 (5 there, where vertices count from 1) names vertex 4, but the file has 4 vertices (0 to 3): correct the index");
    // Three digits are too few.
    insta::assert_snapshot!(cone_file_refusal("0 3.14\n1 3.14\n2 3.14\n3 3.14", "", 1), @"failed: tetra (prescription): the prescribed curvatures sum to 3.9979721705π (12.560000000 rad), but Gauss–Bonnet requires 2πχ = 4π (12.566370614 rad) on a surface with χ = 2 (genus 0, 0 boundary loops): change the total by 0.0020278295π");
    insta::assert_snapshot!(cone_file_refusal(pi, "strategy = \"spread\"\n", 1), @r#"failed: tetra (prescription): cones.file and cones.strategy = "spread" exclude each other: remove one of them"#);
    insta::assert_snapshot!(cone_file_refusal(pi, "list = [{ vertex = 0, curvature = 1 }]\n", 2), @r"
    error: `cones.list` and `cones.file` exclude each other
    help: remove one of them
    ");
    insta::assert_snapshot!(cone_file_refusal(pi, "max_curvature = 2\n", 2), @r#"
     error: `cones.max_curvature` takes a number or a fraction such as "1/2", from 0 to below 2, but
     | was given 2
      ,-[config.toml:3:17]
    2 | file = "my.cones.txt"
    3 | max_curvature = 2
      :                 ^
      `----
     help: `cones.max_curvature`: a number or a fraction such as "1/2", from 0 to below 2, in
           multiples of π; default "9/8"
    "#);
    let folder = folder();
    insta::assert_snapshot!(refusal(folder.path(), &["build", "a.obj", "--set", "cones.file=b.txt"], 2), @r"
    error: `cones.file` names b.txt, which cannot be read: there is no such file
    help: `cones.file` starts at the configuration's folder (with `--set` at the current one); check
          the name and that it is UTF-8 text
    ");
}

/// What peers write is rounded: the miss is shared out, and said.
#[test]
fn rounding_of_a_cone_file_is_shared_out_with_a_note() {
    let text = "1 3.14159\n2 3.14159\n3 3.14159\n4 3.14159 # MovingCones counts from 1\n";
    let folder = cone_file(text, "file_first_vertex = 1\n");
    let output = run(folder.path(), &["check", "config.toml", "tetra.obj"]);
    assert!(output.status.success(), "{}", stderr(&output));
    insta::assert_snapshot!(stderr(&output).trim_start(), @"WARN the curvatures of cones.file sum to 12.566360000 rad instead of 12.566370614, as far off as rounding of their text can be: shared out among 4 cones");
    insta::assert_snapshot!(stdout(&output), @r"
    tetra (tetra.obj)
    4 vertices, 4 triangles, 1 component
      repair: nothing
      topology: genus 0, 0 boundary loops, Euler characteristic 2
      connectivity repair: off
      Gauss–Bonnet: 4π required, 4π prescribed
      4 cones of 1π: at vertices 0, 1, 2 and 3 of the file
      flat metric: exists; with flips Gauss–Bonnet and positive cone angles are all it takes, and both hold
    ");
}

/// The table of a survey without its seconds.
#[test]
fn a_survey_says_what_cones_gain() {
    let folder = cone_file("", "");
    let arguments = ["cones", "tetra.obj", "--set", "pictures.enabled=false"];
    let output = run(
        folder.path(),
        &[&arguments[..], &["--counts", "0,4"]].concat(),
    );
    assert_eq!(output.status.code(), Some(1), "0 cones cannot be");
    let without_seconds = |line: &str| match line.rsplit_once("  ") {
        Some((rest, last)) if last.trim().parse::<f64>().is_ok() => rest.trim_end().to_owned(),
        _ => line.to_owned(),
    };
    let text: Vec<String> = stdout(&output).lines().map(without_seconds).collect();
    insta::assert_snapshot!(text.join("\n"), @r#"
    tetra (tetra.obj)
      4 vertices, 4 triangles, genus 0, 0 boundary loops: cones need 4π in total
      cones     placed  distortion (9)  std of u  least u  greatest u  angle error     cut  cut/√area  seconds
      spread 4       4          0.0000    0.0000    +0.00       +0.00      0.0000π  8.4853       2.28
      none      a closed surface of genus 0 (χ = 2) needs cones of total curvature 4π, but there are none: set cones.strategy = "auto" or "spread", or list cones
      auto 4         4          0.0000    0.0000    +0.00       +0.00      0.0000π  8.4853       2.28
      suggested: 4, for no other number was tried (standard deviation of the log scale 0.000)
    wrote affine-atlas-out/tetra.cones (3 files)
    build it with: affine-atlas build affine-atlas-out/tetra.cones/tetra.cones-4.toml
    "#);
    assert!(stderr(&output).contains("[1/1] tetra: failed after"));
    // By default only what can be is tried.
    let output = run(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("[1/1] tetra: surveyed after"),
        "{}",
        stderr(&output)
    );
    assert!(!stdout(&output).contains("none"), "{}", stdout(&output));
}

#[test]
fn a_survey_keeps_what_is_not_its_own() {
    let folder = cone_file("", "");
    let place = folder.path().join("out/tetra.cones");
    std::fs::create_dir_all(&place).expect("created");
    std::fs::write(place.join("notes.txt"), "mine").expect("written");
    let text = refusal(
        folder.path(),
        &["cones", "tetra.obj", "--out", "out", "--quiet"],
        1,
    );
    insta::assert_snapshot!(text, @"failed: tetra (output): out/tetra.cones exists and holds nothing that this command wrote earlier, so it is not replaced; move it away or choose another output folder");
    assert!(place.join("notes.txt").exists());
    // Nor an input that lies in an older folder of ours.
    std::fs::write(place.join("cones.json"), "{}").expect("written");
    std::fs::write(place.join("tetra.obj"), TETRAHEDRON).expect("written");
    let arguments = ["cones", "out/tetra.cones/tetra.obj", "--out", "out"];
    insta::assert_snapshot!(refusal(folder.path(), &arguments, 2), @r"
    error: the output folder out/tetra.cones of this run would replace the folder of its input out/
    | tetra.cones/tetra.obj
    help: choose another folder with `--out`
    ");
}

/// A folder with two tetrahedra in folders of their own, and a configuration that finds them.
fn two_sets(keys: &str) -> tempfile::TempDir {
    let folder = folder();
    for set in ["left", "right"] {
        std::fs::create_dir_all(folder.path().join("meshes").join(set)).expect("made");
        let path = folder.path().join("meshes").join(set).join("t.obj");
        std::fs::write(path, TETRAHEDRON).expect("written");
    }
    let text = format!(
        "[input]\npaths = [\"meshes\"]\n[cones]\nstrategy = \"spread\"\ncount = 4\n[patches]\ntexel_budget = 4096\n[pictures]\nenabled = false\n{keys}"
    );
    std::fs::write(folder.path().join("config.toml"), text).expect("written");
    folder
}

#[test]
fn inputs_that_name_nothing() {
    let folder = two_sets("");
    insta::assert_snapshot!(refusal(folder.path(), &["build", "*.ply"], 3), @r"
    error: no mesh was found: *.ply matches no mesh file (gltf, glb, obj, ply, stl, off)
    help: check names and folders; quotes keep the shell from replacing `*` by itself
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["build", "@tonight.txt"], 2), @r"
    error: the list tonight.txt cannot be read: No such file or directory (os error 2)
    help: `@FILE` names a text file with a mesh, folder or glob on each line: check the name and
          that it is UTF-8 text
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["build", "meshes/[a"], 2), @r"
    error: `meshes/[a` is no glob: invalid range pattern
    help: `*` stands for any part of a name, `**` for any folders, `?` for one character, `[abc]`
          for one of these; write `[[]` for a bracket
    ");
}

#[test]
fn tables_for_some_meshes_that_are_wrong() {
    let refused = |keys: &str| refusal(two_sets(keys).path(), &["build"], 2);
    insta::assert_snapshot!(refused("[[asset]]\nglob = \"*\"\nflow.shceme = \"thurston\"\n"), @r#"
     error: unknown key `flow.shceme`
       ,-[config.toml:12:6]
    11 | glob = "*"
    12 | flow.shceme = "thurston"
       :      ^^^^^^
       `----
     help: did you mean `flow.scheme`?
    "#);
    insta::assert_snapshot!(refused("[[asset]]\nflow.scheme = \"thurston\"\n"), @r#"
     error: an `[[asset]]` table says neither by `glob` nor by `path` which meshes it is for
       ,-[config.toml:10:1]
     9 | enabled = false
    10 | [[asset]]
       : ^^^^^^^^^
    11 | flow.scheme = "thurston"
       `----
     help: give one of them, for example `glob = "scans/*.ply"`
    "#);
    insta::assert_snapshot!(refused("[[asset]]\nglob = \"*\"\nrun.jobs = 2\n"), @r#"
     error: `run.jobs` concerns the whole run and not single meshes
       ,-[config.toml:12:5]
    11 | glob = "*"
    12 | run.jobs = 2
       :     ^^^^
       `----
     help: write it outside of the `[[asset]]` tables
    "#);
}

/// What a dry run says before and after a build, and that it builds nothing.
#[test]
fn a_dry_run_says_why() {
    let folder = two_sets(
        "[[asset]]\nglob = \"meshes/left/*\"\npatches.padding = 3\n[[asset]]\npath = \"none.obj\"\n",
    );
    let dry = |arguments: &[&str]| {
        let output = run(
            folder.path(),
            &[&["build", "--dry-run"], arguments].concat(),
        );
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        (stdout(&output), stderr(&output))
    };
    let (said, warned) = dry(&[]);
    insta::assert_snapshot!(said, @r"
    build   left-t   new
    build   right-t  new
    2 of 2 would be built
    ");
    insta::assert_snapshot!(warned.trim_start(), @"WARN config.toml:13:1: no mesh of this run matches `none.obj`: this [[asset]] table has no effect");
    assert!(!folder.path().join("affine-atlas-out").exists());
    let output = run(folder.path(), &["build", "--quiet"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    insta::assert_snapshot!(dry(&[]).0, @r"
    cached  left-t
    cached  right-t
    0 of 2 would be built
    ");
    insta::assert_snapshot!(dry(&["--set", "patches.padding=3"]).0, @r"
    cached  left-t
    build   right-t  configuration key patches.padding changed from 2 to 3
    1 of 2 would be built
    ");
    insta::assert_snapshot!(dry(&["--force"]).0, @r"
    build   left-t   forced
    build   right-t  forced
    2 of 2 would be built
    ");
    std::fs::write(folder.path().join("meshes/right/t.obj"), "v 0 0 0").expect("written");
    std::fs::remove_file(folder.path().join("affine-atlas-out/left-t/atlas.npz")).expect("there");
    insta::assert_snapshot!(dry(&[]).0, @r"
    build   left-t   outputs missing: atlas.npz
    build   right-t  input changed
    2 of 2 would be built
    ");
    // The mesh that is refused now keeps its older folder, and says so.
    let output = run(folder.path(), &["build", "--quiet"]);
    assert_eq!(output.status.code(), Some(1));
    insta::assert_snapshot!(stderr(&output).lines().last().unwrap_or_default(), @"failed: right-t (input): meshes/right/t.obj: holds no triangle (1 vertices, 0 faces); export a surface mesh, not points or curves; the older result was kept");
    assert!(
        folder
            .path()
            .join("affine-atlas-out/right-t/atlas.json")
            .exists()
    );
}

#[test]
fn the_worker_is_for_builds_alone() {
    let folder = folder();
    let output = run(folder.path(), &["worker", "a.obj", "out"]);
    assert_eq!(output.status.code(), Some(2));
    insta::assert_snapshot!(stderr(&output), @"`affine-atlas worker` is for `affine-atlas build` alone: EOF while parsing a value at line 1 column 0");
    let help = stdout(&run(folder.path(), &["--help"]));
    assert!(!help.contains("worker"), "{help}");
}

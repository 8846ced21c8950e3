//! Acts in which a process ends, time or memory runs out, or the cache lies.

use crate::folders::unfinished;
use crate::stage::{ASSETS, Run, Stage, kill, lives, workers};
use libtest_mimic::Failed;
use std::fs;
use std::time::{Duration, Instant};

type Found = Result<Option<String>, Failed>;

/// Every other asset is built, and the next run builds the one.
pub fn a_worker_is_killed() -> Found {
    let mut stage = Stage::new();
    let run = Run::start(stage.command());
    run.wait_for(5);
    // A worker lives for a tenth of a second: one that was hit in time is looked for.
    let mut hits = 0;
    for _ in 0..40 {
        hits += usize::from(
            workers(run.id())
                .first()
                .is_some_and(|&worker| kill("KILL", worker)),
        );
        if hits >= 3 {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let (code, said) = run.end();
    let failed = stage.in_state("failed");
    assert!(
        !failed.is_empty() && failed.len() <= hits,
        "{failed:?} of {hits} hits: {said}"
    );
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("killed from outside (signal 9)"), "{said}");
    assert!(said.contains("the older result was kept"), "{said}");
    for id in &failed {
        let record = &stage.manifest()[id];
        assert_eq!(
            (&record["kind"], &record["kept"]),
            (&"internal".into(), &true.into())
        );
        assert!(
            record["files"]
                .as_array()
                .is_some_and(|files| !files.is_empty())
        );
    }
    stage.nothing_is_lost();
    // One that was killed between its folder's appearance and its last word has tonight's folder all the same.
    assert!(stage.done() >= ASSETS - failed.len());
    assert_eq!(unfinished(&stage.out), [""; 0]);
    stage.completes();
    assert_eq!(stage.in_state("built"), failed);
    Ok(None)
}

/// Workers die with the batch; what was finished is not built again.
pub fn the_batch_is_killed() -> Found {
    let mut stage = Stage::new();
    let run = Run::start(stage.command());
    run.wait_for(15);
    let workers = workers(run.id());
    assert!(kill("KILL", run.id()));
    let since = Instant::now();
    while workers.iter().any(|&worker| lives(worker)) {
        assert!(
            since.elapsed() < Duration::from_secs(10),
            "workers outlive the batch"
        );
        std::thread::sleep(Duration::from_millis(10));
    }
    let (code, _) = run.end();
    assert_eq!(code, None, "killed");
    stage.nothing_is_lost();
    assert!(stage.done() >= 15);
    stage.completes();
    assert!(
        stage.in_state("cached").len() >= 15,
        "finished work was done again"
    );
    Ok(None)
}

/// Children are stopped, staging is removed, what is finished is recorded.
pub fn ctrl_c() -> Found {
    let mut stage = Stage::new();
    let run = Run::start(stage.command());
    run.wait_for(15);
    assert!(kill("INT", run.id()));
    let (code, said) = run.end();
    assert_eq!(code, Some(130), "{said}");
    assert_eq!(unfinished(&stage.out), [""; 0]);
    stage.nothing_is_lost();
    let (built, cancelled) = (stage.in_state("built"), stage.in_state("cancelled"));
    assert!(built.len() >= 15 && !cancelled.is_empty(), "{said}");
    assert_eq!(built.len() + cancelled.len(), ASSETS);
    stage.completes();
    assert!(stage.in_state("cached").len() >= built.len());
    Ok(None)
}

/// Only that asset fails, with its kind, and says what to change.
pub fn an_asset_runs_out_of_memory() -> Found {
    let mut stage = Stage::new();
    let config = fs::read_to_string(stage.folder().join("config.toml"))?;
    stage.configure("[[asset]]\nglob = \"a0005.*\"\nrun.memory = 6000000\n");
    let (code, said) = Run::start(stage.command()).end();
    assert_eq!(code, Some(1), "{said}");
    assert_eq!(stage.in_state("failed"), ["set-0-a0005"]);
    let record = &stage.manifest()["set-0-a0005"];
    assert_eq!(
        (&record["kind"], &record["kept"]),
        (&"memory".into(), &true.into()),
        "{record}"
    );
    assert!(said.contains("run.memory"), "{said}");
    stage.nothing_is_lost();
    fs::write(stage.folder().join("config.toml"), config)?;
    stage.completes();
    assert_eq!(stage.in_state("built"), ["set-0-a0005"]);
    Ok(None)
}

/// The same for time: one mesh becomes a large one, with cones that are searched for.
pub fn an_asset_runs_out_of_time() -> Found {
    let mut stage = Stage::new();
    let mesh = stage.folder().join("meshes/set-0/a0000.obj");
    let small = fs::read(&mesh)?;
    let config = fs::read_to_string(stage.folder().join("config.toml"))?;
    let large = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/fixtures/good/genus-3-pretzel.obj"
    );
    fs::copy(large, &mesh)?;
    let slow = "cones.strategy = \"auto\"\ncones.count = 64\npatches.texel_budget = 16000000";
    stage.configure(&format!(
        "[[asset]]\npath = \"meshes/set-0/a0000.obj\"\nrun.timeout = 1\n{slow}\n"
    ));
    let start = Instant::now();
    let (code, said) = Run::start(stage.command()).end();
    assert_eq!(code, Some(1), "{said}");
    let record = &stage.manifest()["set-0-a0000"];
    assert_eq!(
        (&record["state"], &record["kind"]),
        (&"failed".into(), &"timeout".into())
    );
    let seconds = record["seconds"].as_f64().ok_or("seconds")?;
    assert!(
        (1.0..start.elapsed().as_secs_f64()).contains(&seconds),
        "{seconds}"
    );
    assert!(said.contains("the 1 s of run.timeout"), "{said}");
    let log = fs::read_to_string(stage.out.join("logs/set-0-a0000.log"))?;
    assert!(
        log.lines()
            .last()
            .is_some_and(|line| line.contains("timeout")),
        "{log}"
    );
    stage.nothing_is_lost();
    assert_eq!(unfinished(&stage.out), [""; 0]);
    fs::write(mesh, small)?;
    fs::write(stage.folder().join("config.toml"), config)?;
    stage.completes();
    assert_eq!(stage.in_state("built"), ["set-0-a0000"]);
    Ok(None)
}

/// Damaged entries and damaged outputs are built again, and nothing else; the dry run says why.
pub fn the_cache_is_corrupted() -> Found {
    let mut stage = Stage::new();
    let (code, said) = Run::start(stage.command()).end();
    assert_eq!(code, Some(0), "{said}");
    // The watcher must not blame the program for what follows.
    stage.look_away();
    let flip = |path: &str, at: usize| -> Result<(), Failed> {
        let path = stage.out.join(path);
        let mut bytes = fs::read(&path)?;
        bytes[at] ^= 4;
        Ok(fs::write(path, bytes)?)
    };
    flip(".affine-atlas/cache/set-0-a0000.json", 200)?;
    flip("set-0-a0002/images/0000.exr", 900)?;
    fs::remove_file(stage.out.join("set-0-a0003/atlas.npz"))?;
    fs::write(stage.out.join(".affine-atlas/cache/set-0-a0005.json"), "")?;
    fs::remove_dir_all(stage.out.join("set-0-a0006"))?;
    let dry = stage.command().arg("--dry-run").output()?;
    let reasons = String::from_utf8_lossy(&dry.stdout);
    let reasons: Vec<&str> = reasons.split_whitespace().collect();
    let reasons = reasons.join(" ");
    assert_eq!(dry.status.code(), Some(0), "{reasons}");
    for reason in [
        "set-0-a0000 cache entry damaged",
        "set-0-a0002 outputs damaged: images/0000.exr",
        "set-0-a0003 outputs missing: atlas.npz",
        "set-0-a0005 cache entry damaged",
        "set-0-a0006 outputs missing: ",
        "5 of 60 would be built",
    ] {
        assert!(reasons.contains(reason), "{reason}: {reasons}");
    }
    stage.completes();
    let expected = [0, 2, 3, 5, 6].map(|i| format!("set-0-a000{i}"));
    assert_eq!(stage.in_state("built"), expected);
    Ok(None)
}

/// Two runs at the same time, each with one half of the assets, leave each other's work alone.
pub fn two_batches_share_a_root() -> Found {
    let mut stage = Stage::new();
    let half = |sets: &str| {
        let mut command = stage.command();
        command.arg("--set").arg(format!("input.paths=[{sets}]"));
        Run::start(command)
    };
    // Ids are those of the whole folder: its place below `meshes` is in both globs.
    let runs = [
        half("\"meshes/*/*[02468].*\""),
        half("\"meshes/*/*[13579].*\""),
    ];
    for run in runs {
        let (code, said) = run.end();
        assert_eq!(code, Some(0), "{said}");
    }
    stage.ends_well();
    Ok(None)
}

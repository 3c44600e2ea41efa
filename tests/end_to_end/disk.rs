//! Disks that are slower than the run, or full before its end.

use std::{
    fs::File,
    io::Read as _,
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use super::program::{Workplace, json, said, stagger};

#[test]
fn a_slow_disk_makes_the_run_wait_loses_nothing_and_is_told() {
    let place = Workplace::with("falling-powder.toml");
    let expected = json(&place.run(&["--no-record", "--json"]));
    // A pipe that is read late: the run makes some 6 MB, of which a chunk of 4 MiB, the pipe and the buffer hold most.
    let pipe = place.path("pipe.mcap");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let late = Duration::from_secs(6);
    let reader = thread::spawn({
        let pipe = pipe.clone();
        move || {
            let mut file = File::open(pipe).unwrap();
            let mut bytes = vec![0; 1000];
            file.read_exact(&mut bytes).unwrap();
            thread::sleep(late);
            file.read_to_end(&mut bytes).unwrap();
            bytes
        }
    });
    let output = place.run(&["--record", "pipe.mcap", "--json", "--set", "record.buffer=1"]);
    let summary = json(&output);
    assert_eq!(summary["hash"], expected["hash"]);
    assert_eq!(summary["recording"]["lost"], 0);
    let waited = summary["recording"]["waited_s"].as_f64().unwrap();
    // What is left of the six seconds when the buffer is full: the run alone takes one or two.
    assert!(waited > 1.0 && waited < late.as_secs_f64(), "{waited} s");
    assert!(said(&output).contains("the disk is slower than the run"), "{}", said(&output));
    std::fs::write(place.path("run.mcap"), reader.join().unwrap()).unwrap();
    let info = stagger().args(["info", "--json"]).arg(place.path("run.mcap")).output().unwrap();
    assert_eq!(json(&info)["steps_accepted"], summary["steps"]["accepted"]);
}

#[test]
fn a_disk_that_fills_up_ends_the_run_after_its_step_and_the_run_can_go_on_from_what_was_written() {
    let place = Workplace::with("falling-powder.toml");
    let expected = json(&place.run(&["--no-record", "--json"]));
    // A limit on the size of files gives the same error at the same place as a full disk, for whoever may not mount one.
    let limited = format!(
        "trap '' XFSZ; ulimit -f 5000; exec '{}' run '{}' --in-process --record run.mcap --set recovery.checkpoint=10",
        env!("CARGO_BIN_EXE_stagger"),
        place.scene.display()
    );
    let run = Command::new("sh")
        .args(["-c", &limited])
        .current_dir(place.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("the run ends with this step"), "{}", said(&output));
    assert!(said(&output).contains("cannot write the recording"), "{}", said(&output));
    let info = stagger().args(["info", "--json"]).arg(place.path("run.mcap")).output().unwrap();
    assert_eq!(info.status.code(), Some(3), "{}", said(&info));
    let resumed = place.run(&["--resume", "run.mcap", "--no-record", "--json", "--set", "recovery.checkpoint=10"]);
    assert_eq!(json(&resumed)["hash"], expected["hash"]);
}

//! Files a scene names, and files that a recording is written to.

use stagger_physics::particles::Start;
use stagger_scene::Scene;

use super::program::{Workplace, json, said, stagger};

/// Three particles over a plate, of which two begin where they overlap.
const SCENE: &str = r#"
duration = "0.2 ms"
[particles]
start = { kind = "file", path = "bed.csv", unit = "um", velocity = [0, 0, -0.1] }
contact = { damping = "8e5 N s/m^3" }
[walls.plate]
plane = { normal = [0, 0, 1] }
[thermal]
[coupling]
dt = "5 us"
[recovery]
checkpoint = 10
"#;
const BED: &str = "x,y,z,radius\n0,0,30,25\n40,0,30,25\n0,0,90,20\n";

#[test]
fn a_recording_holds_the_files_of_its_scene() {
    let place = Workplace::of(SCENE);
    let absent = place.run(&["--no-record"]);
    assert_eq!(absent.status.code(), Some(2));
    assert!(said(&absent).contains("particles.start.path: cannot read \"bed.csv\""), "{}", said(&absent));
    let bed = place.path("bed.csv");
    std::fs::write(&bed, BED).unwrap();
    let whole = json(&place.run(&["--record", "run.mcap", "--json"]));
    let in_process = json(&place.run(&["--no-record", "--in-process", "--json"]));
    assert_eq!(in_process["hash"], whole["hash"]);

    // On another machine there is the recording, and perhaps the scene, but not what it names.
    std::fs::remove_file(&bed).unwrap();
    let recording = place.path("run.mcap");
    let verified = json(&stagger().arg("verify").arg(&recording).arg("--json").output().unwrap());
    assert_eq!(verified["hash"], whole["hash"]);
    let resumed = json(&place.run(&["--resume", "run.mcap@20", "--no-record", "--json"]));
    assert_eq!(resumed["hash"], whole["hash"]);
    let again = json(&place.run(&["--files", "run.mcap", "--no-record", "--json"]));
    assert_eq!(again["hash"], whole["hash"]);

    // A file that has changed makes another scene.
    std::fs::write(&bed, BED.replace("30,25", "31,25")).unwrap();
    let changed = place.run(&["--resume", "run.mcap", "--no-record"]);
    assert!(said(&changed).contains("another scene"), "{}", said(&changed));
    place.wait_until_empty();
}

#[test]
fn an_exported_state_is_the_recorded_one_and_can_be_a_start() {
    let place = Workplace::with("quick.toml");
    let run = json(&place.run(&["--record", "run.mcap", "--json"]));
    let export = |more: &[&str]| {
        let mut command = stagger();
        command.arg("export").arg(place.path("run.mcap")).arg("--out").arg(place.path("series")).args(more);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let said = export(&["--contacts", "--every", "7"]);
    let steps = run["steps"]["accepted"].as_u64().unwrap();
    // The start, every seventh step, and the last one.
    let states = 1 + steps / 7 + u64::from(!steps.is_multiple_of(7));
    assert!(said.starts_with(&format!("{states} states:")), "{said} {steps}");
    for series in ["particles", "contacts"] {
        let list = std::fs::read_to_string(place.path(&format!("series/{series}.pvd"))).unwrap();
        assert_eq!(list.matches("<DataSet timestep=").count() as u64, states);
        assert!(list.contains(&format!("timestep=\"0e0\" part=\"0\" file=\"{series}-000000.vtp\"")), "{list}");
        for name in list.split("file=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
            layout(&std::fs::read(place.path("series").join(name)).unwrap());
        }
    }

    // Read as a start, the exported end is the recorded one to the last bit.
    let recording = stagger_recordings::Recording::open(place.path("run.mcap")).unwrap();
    let mut newest = stagger_recordings::Steps::default();
    let last = recording.messages().unwrap().filter_map(|message| newest.take(message.unwrap()).step).last().unwrap();
    let text = format!(
        "duration = 1\n[particles]\nstart = {{ kind = \"file\", path = \"particles-{:06}.vtp\" }}\n[coupling]\ndt = 1\n",
        last.version.step
    );
    let read = |path: &str| std::fs::read(place.path("series").join(path)).map_err(|error| error.to_string());
    let scene = Scene::parse_with_files(&text, "x.toml", &[], &read).unwrap();
    let Start::Given { positions_m, velocities_m_s, radii_m, .. } =
        scene.settings::<stagger_physics::particles::Settings>().unwrap().clone().start
    else {
        panic!("given")
    };
    let recorded = |name: &str| last.fields[name].f64().unwrap().to_vec();
    assert_eq!(positions_m.concat(), recorded("positions"));
    assert_eq!(velocities_m_s.concat(), recorded("velocities"));
    assert_eq!(radii_m, recorded("radii"));
}

/// Every array begins with its length where the one before ends, and the last one ends with the file's data.
fn layout(contents: &[u8]) {
    let mark = b"<AppendedData encoding=\"raw\">\n_";
    let at = contents.windows(mark.len()).position(|window| window == mark).unwrap() + mark.len();
    let (head, data) = contents.split_at(at);
    let head = String::from_utf8(head.to_vec()).unwrap();
    assert!(head.contains("Name=\"TimeValue\"") && head.contains("Name=\"positions\""), "{head}");
    let mut expected = 0;
    for offset in head.split("offset=\"").skip(1) {
        let offset: usize = offset.split('"').next().unwrap().parse().unwrap();
        assert_eq!(offset, expected);
        expected += 8 + u64::from_le_bytes(data[offset..offset + 8].try_into().unwrap()) as usize;
    }
    assert_eq!(&data[expected..], b"\n</AppendedData>\n</VTKFile>\n");
}

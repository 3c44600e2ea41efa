//! Following an advice with the program, and what that changes.

use std::process::Command;

use serde_json::Value;

/// What the program makes of a scene's text and `--set` values.
pub struct Case {
    text: String,
    sets: Vec<String>,
    folder: tempfile::TempDir,
}

impl Case {
    /// A scene with `--set` values of its own.
    pub fn new(text: &str, sets: &[&str]) -> Self {
        let sets = sets.iter().map(|set| (*set).to_owned()).collect();
        Self { text: text.to_owned(), sets, folder: tempfile::tempdir().unwrap() }
    }

    fn call(&self, arguments: &[&str]) -> Value {
        let scene = self.folder.path().join("scene.toml");
        std::fs::write(&scene, &self.text).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_stagger"));
        command.arg(arguments[0]).arg(scene).args(&arguments[1..]);
        command.args(self.sets.iter().flat_map(|set| ["--set", set]));
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}\n{}", String::from_utf8_lossy(&output.stderr), self.text);
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// The advice about a key with a number of this name.
    pub fn advice(&self, about: &str, number: &str) -> Value {
        let report = self.call(&["check", "--advise", "--json"]);
        let all = report["advice"].as_array().unwrap();
        let found = all.iter().find(|own| own["about"] == about && own["number"] == number);
        found.unwrap_or_else(|| panic!("no {number} of {about} in {report:#}")).clone()
    }

    /// The scene with an advice's edits, or with others.
    pub fn edited(&self, edits: &Value) -> Self {
        let mut case = Self::new(&self.text, &[]);
        case.sets.clone_from(&self.sets);
        for edit in edits.as_array().unwrap() {
            if let Some(set) = edit.get("set") {
                let value = format!("{}={}", set["key"].as_str().unwrap(), set["value"].as_str().unwrap());
                case.sets.push(value);
                continue;
            }
            let key = edit["delete"]["key"].as_str().unwrap();
            let mut scene: toml::Table = case.text.parse().unwrap();
            let (path, last) =
                key.rsplit_once('.').map_or((Vec::new(), key), |(path, last)| (path.split('.').collect(), last));
            let table = path.iter().try_fold(&mut scene, |table, name| table.get_mut(*name)?.as_table_mut());
            // Tests set some of what they delete by --set alone.
            if let Some(table) = table {
                table.remove(last);
            }
            case.text = toml::to_string(&scene).unwrap();
            case.sets.retain(|set| !set.starts_with(&format!("{key}=")) && !set.starts_with(&format!("{key}.")));
        }
        case
    }

    /// Runs it in one process.
    pub fn run(&self) -> Outcome {
        Outcome(self.call(&["run", "--in-process", "--no-record", "--json"]))
    }
}

/// The summary of a run.
pub struct Outcome(Value);

impl Outcome {
    fn field(&self, name: &str, of: &str) -> Option<f64> {
        self.0["fields"].as_array().unwrap().iter().find(|field| field["field"] == name)?[of].as_f64()
    }

    /// A quantity by the name that advice has for it, in SI units; particles without a temperature of their own stay at 300 K.
    pub fn of(&self, quantity: &str) -> f64 {
        match quantity {
            "mean-temperature" => self.field("temperature", "mean").unwrap_or(300.0),
            "peak-temperature" => self.field("temperature", "max").unwrap_or(300.0),
            // The summary's mean is that of all components: this is the mean position's component along (1, 1, 1).
            "mean-position" => 3f64.sqrt() * self.field("positions", "mean").unwrap(),
            "rebound-speed" => {
                let [least, most] = ["min", "max"].map(|of| self.field("velocities", of).unwrap());
                least.abs().max(most.abs())
            }
            "absorbed-energy" => self.0["ledger"]["optics"]["lost"]["absorbed"].as_f64().unwrap_or(0.0),
            other => panic!("no quantity {other}"),
        }
    }
}

/// Follows an advice to leave something out or to take a cheaper fidelity, and asserts that each quantity it names changes by
/// less than it says, and that what it says is not more than `useful`, as a share.
pub fn holds(case: &Case, about: &str, number: &str, verdict: &str, useful: f64) {
    let advice = case.advice(about, number);
    assert_eq!(advice["verdict"], verdict, "{advice:#}");
    let (before, after) = (case.run(), case.edited(&advice["edits"]).run());
    let effects = advice["effects"].as_array().unwrap();
    assert!(!effects.is_empty() && !advice["edits"].as_array().unwrap().is_empty(), "{advice:#}");
    for effect in effects {
        let quantity = effect["quantity"].as_str().unwrap();
        let (before, after) = (before.of(quantity), after.of(quantity));
        let (at_most, share) = (effect["at_most"].as_f64().unwrap(), effect["share"].as_f64().unwrap());
        assert!((after - before).abs() < at_most, "{about}: {quantity} from {before} to {after}, said {at_most}");
        assert!(share <= useful, "{about}: {quantity} by {share} is no advice");
    }
}

/// Asserts that an advice does not say `never`, and that `edits` then change a quantity by more than the share `by` of itself.
pub fn matters(case: &Case, about: &str, number: &str, never: &str, edits: &Value, quantity: &str, by: f64) {
    let advice = case.advice(about, number);
    assert_ne!(advice["verdict"], never, "{advice:#}");
    let (before, after) = (case.run().of(quantity), case.edited(edits).run().of(quantity));
    assert!((after - before).abs() > by * before.abs(), "{about}: {quantity} from {before} to {after} only");
}

//! `stagger tradeoff`.

use std::path::PathBuf;

use stagger_runtime::run::{interrupt, outputs::Inputs};
use stagger_scene::Scene;
use stagger_tools::tradeoff::{self, Failed, Options, Quantity, Workshop};

use super::{End, FAILED, MISSING, USAGE, arguments::TradeoffArguments, failed, parse, print, print_json, read_scene};

/// What runs record: their first and last state, which is all that is compared.
const RECORDED: [(&str, &str); 3] =
    [("record.level", "\"accepted\""), ("record.every", "1000000000"), ("record.frames", "0")];

pub(super) fn tradeoff(arguments: TradeoffArguments, threads: Option<usize>) -> End {
    let mut overrides = arguments.scene.overrides();
    let read = read_scene(&arguments.scene.scene)
        .and_then(|file| Ok((parse(&file, &overrides, arguments.scene.files.as_deref())?, file)));
    let (scene, file) = match read {
        Ok(read) => read,
        Err(end) => return end,
    };
    if !file.can_be_read_again(&scene) {
        let why = "the scene, or a file it names, comes from a pipe; it is read for every run: save it to a file first";
        return End::Code(USAGE, why.into());
    }
    let mut quantities = arguments.quantity;
    // Orders are those of whole fields: in sums and means errors may cancel.
    if quantities.is_empty() && !arguments.orders {
        match scene.quantities.iter().map(|text| text.parse()).collect::<Result<Vec<Quantity>, _>>() {
            Ok(named) => quantities = named,
            Err(error) => return End::Code(USAGE, format!("tradeoff.quantities: {error}")),
        }
    }
    let stem = arguments.scene.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = arguments.out.unwrap_or_else(|| PathBuf::from(format!("tradeoff-{stem}")));
    let mut inputs = Inputs::default();
    file.files(&scene).for_each(|(what, path)| inputs.add(what, &path));
    arguments.scene.files.iter().for_each(|files| inputs.add("the recording of --files", files));
    let results = tradeoff::Results::new(&folder, arguments.overwrite);
    if let Err(error) = results.allowed(&inputs) {
        return End::Code(USAGE, error.to_string());
    }
    // Before what the user sets, who may want to measure recordings.
    overrides.splice(0..0, RECORDED.map(|(key, value)| (key.into(), value.into())));
    let workshop = Workshop {
        scene: arguments.scene.scene,
        overrides,
        files: arguments.scene.files,
        folder,
        in_process: arguments.in_process,
        threads,
        repeat: arguments.repeat.into(),
    };
    let json = arguments.json;
    let mut tell = |text: &str| {
        if !json {
            print(text);
        }
    };
    let interrupted = interrupt::flag();
    if arguments.orders {
        let dt_s = arguments.dt.unwrap_or(scene.coupling.dt.limit_s);
        let quantities = if quantities.is_empty() { rows(&scene) } else { quantities };
        let orders =
            tradeoff::orders(&scene, &workshop, &quantities, (dt_s, arguments.levels), &interrupted, &mut tell);
        return ended(orders.map(|orders| json.then(|| print_json(&orders))));
    }
    let values = |text: &str| text.split(';').map(|value| value.trim().to_owned()).collect();
    let options = Options {
        workshop,
        axes: arguments.axis,
        vary: arguments.vary.iter().map(|(key, text)| (key.clone(), values(text))).collect(),
        reference: arguments.reference,
        quantities,
        results,
        bound: arguments.error,
        longest: arguments.longest,
    };
    let study = tradeoff::study(&scene, &options, &interrupted, &mut tell);
    if study.is_ok() {
        tell(&format!("wrote {0}/tradeoff.html and {0}/tradeoff.csv", options.workshop.folder.display()));
    }
    ended(study.map(|study| json.then(|| print_json(&study))))
}

/// The fields that the scene's physics advance.
fn rows(scene: &Scene) -> Vec<Quantity> {
    let written = scene.written();
    let advanced =
        tradeoff::axis::contributions().flat_map(|own| own.advances).filter(|field| written.contains(**field));
    advanced.map(|field| Quantity::Each((*field).into())).collect()
}

fn ended(result: Result<Option<Result<(), End>>, Failed>) -> End {
    match result {
        Ok(Some(Err(end))) => end,
        Ok(_) => End::Done,
        Err(Failed::Interrupted) => End::Code(MISSING, Failed::Interrupted.to_string()),
        Err(error @ (Failed::Axis { .. } | Failed::Quantity(_))) => End::Code(USAGE, error.to_string()),
        Err(error @ Failed::Base { .. }) => End::Code(FAILED, error.to_string()),
        Err(error) => failed(&error),
    }
}

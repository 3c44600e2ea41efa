//! Hands pictures and curves to Rerun: the only file that knows it.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::Write as _,
    time::Duration,
};

use rerun::{
    Arrows3D, AsComponents, Clear, Color, Image, LineStrips3D, Mesh3D, Points2D, Points3D, RecordingStream,
    RecordingStreamBuilder, RecordingStreamError, Scalars, SeriesLines, SpawnError, SpawnOptions, TextDocument,
    Transform3D, ViewCoordinates,
    blueprint::components::{BackgroundKind, ContainerKind, Corner2D, Eye3DKind, LoopMode, PanelState, PlayState},
    datatypes::{AbsoluteTimeRange, Range2D, TimeInt, Uuid},
    external::{
        re_log_types::{BlueprintActivationCommand, EntityPathPart, LogMsg},
        re_sdk_types::blueprint::archetypes::{
            Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, TimePanelBlueprint,
            ViewBlueprint, ViewContents, ViewportBlueprint, VisualBounds2D,
        },
    },
};

use crate::{
    arguments::Target,
    colour::{NO_VALUE, bar},
    frame::{Beam, Body, Frame, Overview},
    layers::{Layer, Layers},
    layout::{self, Part},
    plots::Point,
    walls::{Outline, Place},
    web::Server,
};
use stagger_messages::codec;

/// Name under which the viewer keeps the window's layout.
const APPLICATION: &str = "stagger";
/// Size of the legend's colour bar, in pixels.
const BAR: [u32; 2] = [400, 36];
/// Colour of the beam.
const BEAM: [u8; 3] = [0x00, 0x8c, 0xff];
/// Colour of labels: they stand on grey, a light one where the reader's system is light.
const INK: [u8; 3] = [0x10, 0x12, 0x16];
/// Colours of curves: the palette of M. Okabe and K. Ito (2008), told apart by the colour-blind too, without its black.
const CURVES: [[u8; 3]; 7] = [
    [0x56, 0xb4, 0xe9],
    [0xe6, 0x9f, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0xf0, 0xe4, 0x42],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x72, 0xb2],
];
/// Colour of walls, whose surfaces hide next to nothing; and half the width of their edges, in shares of a picture.
const WALL: [u8; 3] = [0x50, 0x58, 0x60];
const WALL_OPACITY: u8 = 24;
const WALL_EDGE: f64 = 1e-3;
/// How long a viewer may take to start and to answer.
const ANSWER: Duration = Duration::from_secs(20);
/// Corners of the polygon that stands for the beam's spot.
const BEAM_CORNERS: usize = 48;

/// What can go wrong with the viewer.
#[derive(Debug, thiserror::Error)]
pub enum ShowError {
    /// No viewer is installed.
    #[error(
        "no `rerun` viewer on the PATH: install it with `pip install rerun-sdk==0.36.3` or \
         `cargo install rerun-cli --version 0.36.3 --locked`, or write a file with --save"
    )]
    NoViewer,
    /// Anything else the viewer's library reports.
    #[error("the viewer cannot be fed: {0}")]
    Stream(#[from] RecordingStreamError),
    /// The server for browsers cannot be started or waited for.
    #[error("the viewer cannot be served: {0}")]
    Server(std::io::Error),
    /// The viewer does not take what is sent.
    #[error("the viewer does not answer: {0}; is one running at that address?")]
    NoAnswer(String),
    /// What was sent did not arrive.
    #[error("the pictures could not be delivered: {0}")]
    Flush(String),
}

/// When something is shown.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Simulated time, in s.
    pub t_s: f64,
    /// Accepted steps so far.
    pub step: u64,
    /// Iterations so far, rejected ones too.
    pub iteration: u64,
}

/// A window of the viewer, or a file for it.
pub struct Show {
    stream: RecordingStream,
    /// How many curves each plot has.
    curves: BTreeMap<String, usize>,
    /// The curves whose style was sent.
    known: BTreeSet<String>,
    drawn: Frame,
    places: BTreeMap<String, Place>,
    /// The server, where a browser shows it.
    server: Option<Server>,
}

impl Show {
    /// Opens the window or the file.
    pub fn open(target: &Target, title: &str) -> Result<Self, ShowError> {
        let builder = RecordingStreamBuilder::new(APPLICATION).recording_name(title);
        let server = if *target == Target::Web { Some(Server::start()?) } else { None };
        let stream = match target {
            Target::File(path) => builder.save(path),
            Target::Connect(url) => builder.connect_grpc_opts(url.as_str()),
            Target::Viewer | Target::Web => match &server {
                Some(server) => builder.connect_grpc_opts(server.sink()),
                None => builder.spawn_opts(&SpawnOptions { hide_welcome_screen: true, ..SpawnOptions::default() }),
            },
        };
        let stream = stream.map_err(|error| match error {
            RecordingStreamError::SpawnViewer(SpawnError::ExecutableNotFoundInPath { .. }) => ShowError::NoViewer,
            other => other.into(),
        })?;
        stream.set_log_time_enabled(false);
        stream.set_log_tick_enabled(false);
        stream.log_static("world", &ViewCoordinates::RIGHT_HAND_Z_UP())?;
        // The library would try to connect for ever; nobody should wait for a viewer that is not there.
        stream.flush_with_timeout(ANSWER).map_err(|error| ShowError::NoAnswer(error.to_string()))?;
        if let Some(server) = &server {
            // Where nobody reads it, whoever knows the address can open it all the same.
            let _ = writeln!(std::io::stdout(), "open {} in a browser; Ctrl-C ends it", server.page());
        }
        Ok(Self {
            stream,
            curves: BTreeMap::new(),
            known: BTreeSet::new(),
            drawn: Frame::default(),
            places: BTreeMap::new(),
            server,
        })
    }

    /// Shows a text in Markdown.
    pub fn text(&self, markdown: String) -> Result<(), ShowError> {
        Ok(self.stream.log_static("scene", &TextDocument::from_markdown(markdown))?)
    }

    /// Shows each layer's colour bar with its values.
    pub fn legends(&self, layers: &Layers) -> Result<(), ShowError> {
        let [width, height] = BAR;
        for layer in layers.iter() {
            let path = format!("legend/{}", layer.path);
            self.stream.log_static(format!("{path}/bar"), &Image::from_rgb24(bar(width, height), BAR))?;
            let ticks = layout::ticks(layer);
            let places = ticks.iter().map(|(fraction, _)| [fraction * width as f32, height as f32 + 14.0]);
            let texts = ticks.iter().map(|(_, text)| text.as_str());
            let labels = Points2D::new(places).with_labels(texts).with_radii([0.01]).with_show_labels(true);
            self.stream.log_static(format!("{path}/values"), &labels.with_colors([INK]))?;
        }
        Ok(())
    }

    /// Shows walls where they stand at the start, in a picture between two corners.
    pub fn walls(&self, outlines: &[Outline], [low, high]: [[f64; 3]; 2]) -> Result<(), ShowError> {
        let width = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max) * WALL_EDGE;
        let [red, green, blue] = WALL;
        for outline in outlines {
            let path = path_of_wall(&outline.name);
            let count = outline.corners.len() as u32 / 3;
            let surface = Mesh3D::new(outline.corners.iter().copied())
                .with_triangle_indices((0..count).map(|triangle| [0, 1, 2].map(|corner| 3 * triangle + corner)))
                .with_albedo_factor(*Color::from_unmultiplied_rgba(red, green, blue, WALL_OPACITY));
            self.stream.log_static(format!("{path}/surface"), &surface)?;
            let edges = LineStrips3D::new(outline.edges.iter().copied()).with_radii([width as f32]);
            let edges = edges.with_colors([Color::from_rgb(red, green, blue)]);
            self.stream.log_static(format!("{path}/edges"), &edges)?;
        }
        Ok(())
    }

    /// Shows where walls that move are.
    pub fn places<'a>(
        &mut self,
        places: impl Iterator<Item = (&'a str, Place)>,
        moment: Moment,
    ) -> Result<(), ShowError> {
        self.at(moment);
        for (wall, place) in places {
            if self.places.get(wall) != Some(&place) {
                let transform = Transform3D::from_translation_mat3x3(place.origin, place.axes);
                self.stream.log(path_of_wall(wall), &transform)?;
                self.places.insert(wall.into(), place);
            }
        }
        Ok(())
    }

    /// Shows a state.
    pub fn frame(&mut self, frame: Frame, layers: &Layers, moment: Moment) -> Result<(), ShowError> {
        self.at(moment);
        let unseen = (Body::Nothing, Vec::new());
        for (number, layer) in layers.iter().enumerate() {
            let [now, before] = [&frame, &self.drawn].map(|frame| frame.layers.get(number).unwrap_or(&unseen));
            self.layer(layer, now, before)?;
        }
        if frame.contacts != self.drawn.contacts {
            let lines = LineStrips3D::new(frame.contacts.iter().copied());
            let lines = lines.with_radii([0.25 * frame.scale()]).with_colors([Color::from_rgb(0x50, 0x50, 0x58)]);
            self.stream.log("world/contacts", &lines)?;
        }
        if frame.velocities != self.drawn.velocities {
            let arrows = Arrows3D::from_vectors(frame.velocities.iter().copied())
                .with_origins(frame.centres.iter().copied())
                .with_radii([0.2 * frame.scale()])
                .with_colors([Color::from_rgb(0x20, 0x60, 0x90)]);
            self.stream.log("world/velocities", &arrows)?;
        }
        if frame.rays != self.drawn.rays {
            let lines = LineStrips3D::new(frame.rays.iter());
            let [red, green, blue] = BEAM;
            let lines = lines.with_radii([0.1 * frame.scale()]).with_colors([Color::from_rgb(red, green, blue)]);
            self.stream.log("world/rays", &lines)?;
        }
        for laser in 0..frame.beams.len().max(self.drawn.beams.len()) {
            let [beam, before] = [&frame, &self.drawn].map(|frame| frame.beams.get(laser).and_then(Option::as_ref));
            let path = format!("world/beam/{}", laser + 1);
            match beam {
                _ if beam == before => {}
                Some(beam) => self.beam(&path, beam)?,
                None => self.stream.log(path, &Clear::recursive())?,
            }
        }
        self.drawn = frame;
        Ok(())
    }

    /// What did not change since the last picture is not sent again.
    fn layer(
        &self,
        layer: &Layer,
        (body, colours): &(Body, Vec<[u8; 3]>),
        (body_before, colours_before): &(Body, Vec<[u8; 3]>),
    ) -> Result<(), ShowError> {
        let rgb = |colours: &[[u8; 3]]| -> Vec<Color> {
            colours.iter().map(|[red, green, blue]| Color::from_rgb(*red, *green, *blue)).collect()
        };
        // What has no value is grey.
        let shown = if colours.is_empty() { &[NO_VALUE] } else { colours.as_slice() };
        let same_kind = std::mem::discriminant(body) == std::mem::discriminant(body_before);
        let recoloured = colours != colours_before || !same_kind;
        match (body, body_before) {
            (Body::Nothing, Body::Nothing) => {}
            (Body::Nothing, _) => self.stream.log(layer.path.as_str(), &Clear::recursive())?,
            (Body::Spheres(centres, radii), before) => {
                let (mut points, mut changed) = (Points3D::update_fields(), recoloured);
                let (centres_before, radii_before) = match before {
                    Body::Spheres(centres, radii) => (Some(centres), Some(radii)),
                    _ => (None, None),
                };
                if Some(centres) != centres_before {
                    (points, changed) = (points.with_positions(centres.iter().copied()), true);
                }
                if Some(radii) != radii_before {
                    (points, changed) = (points.with_radii(radii.iter().copied()), true);
                }
                if recoloured {
                    points = points.with_colors(rgb(shown));
                }
                if changed {
                    self.stream.log(format!("{}/points", layer.path), &points)?;
                }
            }
            (Body::Lines(lines, widths), before) => {
                if body != before || recoloured {
                    let strips = LineStrips3D::new(lines.iter().copied()).with_radii(widths.iter().copied());
                    self.stream.log(format!("{}/lines", layer.path), &strips.with_colors(rgb(shown)))?;
                }
            }
            (Body::Faces(corners, triangles), before) => {
                let (mut mesh, moved) = (Mesh3D::update_fields(), body != before);
                if moved {
                    mesh = mesh
                        .with_vertex_positions(corners.iter().copied())
                        .with_triangle_indices(triangles.iter().copied());
                }
                if moved || recoloured {
                    // A mesh has a colour for each corner, or none.
                    let colours = if colours.is_empty() { &vec![NO_VALUE; corners.len()] } else { colours };
                    mesh = mesh.with_vertex_colors(rgb(colours));
                    self.stream.log(format!("{}/faces", layer.path), &mesh)?;
                }
            }
        }
        Ok(())
    }

    fn beam(&self, path: &str, beam: &Beam) -> Result<(), ShowError> {
        let [x, y, z] = beam.spot;
        let at = |height: f32| [x, y, height];
        let corner = |corner: usize| {
            let angle = std::f32::consts::TAU * corner as f32 / BEAM_CORNERS as f32;
            [x + beam.radius * angle.cos(), y + beam.radius * angle.sin()]
        };
        let ring = |height: f32| (0..=BEAM_CORNERS).map(move |i| [corner(i)[0], corner(i)[1], height]);
        let [red, green, blue] = BEAM;
        let colour = Color::from_rgb(red, green, blue);
        // Lines, which hide nothing behind them: where the light falls on the powder, where it would meet the plate,
        // and the way it comes.
        let lines = [ring(beam.surface).collect(), ring(z).collect(), vec![at(beam.top), at(beam.surface)]];
        let lines = LineStrips3D::new(lines).with_colors([colour]);
        self.stream
            .log(format!("{path}/lines"), &lines.with_radii([0.015, 0.01, 0.015].map(|width| width * beam.radius)))?;
        // The wall of a cylinder: two triangles between neighbouring corners.
        let n = BEAM_CORNERS as u32 + 1;
        let wall = (0..n - 1).flat_map(|i| [[i, i + 1, n + i], [i + 1, n + i + 1, n + i]]);
        let mesh = Mesh3D::new(ring(z).chain(ring(beam.top)))
            .with_triangle_indices(wall)
            .with_albedo_factor(*Color::from_unmultiplied_rgba(red, green, blue, 10));
        self.stream.log(format!("{path}/wall"), &mesh)?;
        let label = Points3D::new([at(beam.top)]).with_labels([beam.label.as_str()]).with_radii([0.0]);
        Ok(self.stream.log(format!("{path}/power"), &label.with_colors([INK]).with_show_labels(true))?)
    }

    /// Adds a point to each of some curves.
    pub fn points(&mut self, points: &[Point], moment: Moment) -> Result<(), ShowError> {
        self.at(moment);
        for point in points {
            let path = format!("plots/{}", point.path);
            if self.known.insert(path.clone()) {
                let group = point.path.split('/').next().unwrap_or_default();
                let number = self.curves.entry(group.into()).or_default();
                let colour = CURVES[*number % CURVES.len()];
                *number += 1;
                let style =
                    SeriesLines::new().with_names([point.name.as_str()]).with_widths([2.0]).with_colors([colour]);
                self.stream.log_static(path.as_str(), &style)?;
            }
            self.stream.log(path, &Scalars::single(point.value))?;
        }
        Ok(())
    }

    fn at(&self, moment: Moment) {
        self.stream.set_duration_secs("simulated_time", moment.t_s);
        self.stream.set_time_sequence("step", i64::try_from(moment.step).unwrap_or(i64::MAX));
        self.stream.set_time_sequence("iteration", i64::try_from(moment.iteration).unwrap_or(i64::MAX));
    }

    /// Arranges the window.
    pub fn arrange(&self, overview: &Overview) -> Result<(), ShowError> {
        let (blueprint, messages) = RecordingStreamBuilder::new(APPLICATION).blueprint().memory()?;
        blueprint.set_time_sequence("blueprint", 0);
        let mut window = Window { stream: &blueprint, overview, parts: 0 };
        let (root, _) = window.part(&layout::window(&overview.layers))?;
        blueprint.log("viewport", &ViewportBlueprint::new().with_root_container(root).with_auto_views(false))?;
        for panel in ["blueprint_panel", "selection_panel"] {
            blueprint.log(panel, &PanelBlueprint::new().with_state(PanelState::Collapsed))?;
        }
        let time = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline("simulated_time")
            .with_play_state(PlayState::Following)
            .with_playback_speed(overview.duration_s.map_or(1.0, layout::playback_speed));
        // What is over at the end is shown again and again instead of the end.
        let time = match overview.repeated_s {
            Some(range) => {
                let [min, max] = range.map(|t_s| TimeInt((t_s * 1e9) as i64));
                time.with_play_state(PlayState::Playing)
                    .with_loop_mode(LoopMode::Selection)
                    .with_time_selection(AbsoluteTimeRange { min, max })
            }
            None => time,
        };
        blueprint.log("time_panel", &time)?;
        let messages = messages.take();
        let store = messages.iter().find_map(|message| match message {
            LogMsg::SetStoreInfo(info) => Some(info.info.store_id.clone()),
            _ => None,
        });
        if let Some(blueprint_id) = store {
            let activate = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
            self.stream.send_blueprint(messages, activate);
        }
        Ok(())
    }

    /// Waits until everything has been delivered; where a browser shows it, until that is ended.
    pub fn finish(self) -> Result<(), ShowError> {
        self.stream.flush_blocking().map_err(|error| ShowError::Flush(error.to_string()))?;
        self.server.map_or(Ok(()), Server::wait)
    }
}

/// Where a wall stands among the data; a name in quotes may hold any sign.
fn path_of_wall(name: &str) -> String {
    format!("world/walls/{}", EntityPathPart::new(name).escaped_string())
}

/// Writes the layout of the window in the viewer's terms.
struct Window<'a> {
    stream: &'a RecordingStream,
    overview: &'a Overview,
    parts: u8,
}

impl Window<'_> {
    /// Lays out a part and those within; returns its identifier and its path.
    fn part(&mut self, part: &Part) -> Result<(Uuid, String), ShowError> {
        match part {
            Part::Beside(parts) => {
                let (contents, shares) = self.within(parts)?;
                self.container(ContainerBlueprint::new(ContainerKind::Horizontal).with_col_shares(shares), contents)
            }
            Part::Above(parts) => {
                let (contents, shares) = self.within(parts)?;
                self.container(ContainerBlueprint::new(ContainerKind::Vertical).with_row_shares(shares), contents)
            }
            Part::Tabs(parts) => {
                let paths = parts.iter().map(|part| Ok(self.part(part)?.1));
                let contents = paths.collect::<Result<Vec<_>, ShowError>>()?;
                let tabs = ContainerBlueprint::new(ContainerKind::Tabs);
                let tabs = contents.first().map_or(tabs.clone(), |first| tabs.with_active_tab(first.as_str()));
                self.container(tabs, contents)
            }
            Part::Scene(layer) => self.scene(layer),
            Part::Legend(layer) => self.legend(layer),
            Part::Text(name, origin) => self.view("TextDocument", name, origin, &[]),
            Part::Curves(name, origin) => self.view(
                "TimeSeries",
                name,
                origin,
                &[("PlotLegend", &PlotLegend::new().with_corner(Corner2D::LeftTop))],
            ),
        }
    }

    fn scene(&mut self, layer: &Layer) -> Result<(Uuid, String), ShowError> {
        let quantity = &layer.quantity;
        let view = self.overview.others.get(&quantity.support).copied().unwrap_or(self.overview.view);
        let [eye, target] = layout::camera(view);
        let background = Background::new(BackgroundKind::SolidColor).with_color(Color::from_rgb(0xf4, 0xf5, 0xf7));
        let camera = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position(eye)
            .with_look_target(target)
            .with_eye_up([0.0, 0.0, 1.0]);
        let grid = LineGrid3D::new().with_color(Color::from_unmultiplied_rgba(0x60, 0x68, 0x70, 0x50));
        let name = format!("{} (lengths in {})", quantity.title, self.overview.unit.symbol);
        let properties: [(&str, &dyn AsComponents); 3] =
            [("Background", &background), ("EyeControls3D", &camera), ("LineGrid3D", &grid)];
        self.view("3D", &name, &layer.path, &properties)
    }

    fn legend(&mut self, layer: &Layer) -> Result<(Uuid, String), ShowError> {
        let name = format!("Colour: {} [{}]", layer.quantity.name, layer.quantity.unit);
        let [width, height] = BAR.map(f64::from);
        let bounds = Range2D { x_range: [-30.0, width + 30.0].into(), y_range: [-8.0, height + 44.0].into() };
        let background = Background::new(BackgroundKind::SolidColor).with_color(Color::from_rgb(0xf4, 0xf5, 0xf7));
        let bounds = VisualBounds2D::new(bounds);
        self.view(
            "2D",
            &name,
            &format!("legend/{}", layer.path),
            &[("Background", &background), ("VisualBounds2D", &bounds)],
        )
    }

    fn within(&mut self, parts: &[(f32, Part)]) -> Result<(Vec<String>, Vec<f32>), ShowError> {
        let paths = parts.iter().map(|(_, part)| Ok(self.part(part)?.1));
        let contents = paths.collect::<Result<Vec<_>, ShowError>>()?;
        Ok((contents, parts.iter().map(|(share, _)| *share).collect()))
    }

    fn container(&mut self, container: ContainerBlueprint, contents: Vec<String>) -> Result<(Uuid, String), ShowError> {
        let (id, path) = self.next("container", "container");
        self.stream.log(path.as_str(), &container.with_contents(contents.iter().map(String::as_str)))?;
        Ok((id, path))
    }

    fn view(
        &mut self,
        class: &str,
        name: &str,
        origin: &str,
        properties: &[(&str, &dyn AsComponents)],
    ) -> Result<(Uuid, String), ShowError> {
        let (id, path) = self.next("view", &format!("{class} {name} {origin}"));
        let view = ViewBlueprint::new(class).with_display_name(name).with_space_origin(origin);
        self.stream.log(path.as_str(), &view)?;
        self.stream.log(format!("{path}/ViewContents"), &ViewContents::new(["$origin/**"]))?;
        for (property, components) in properties {
            self.stream.log(format!("{path}/{property}"), *components)?;
        }
        Ok((id, path))
    }

    /// Counted, and with a hash of what it is, identifiers are the same in every file; and where a viewer shows one
    /// layout after the other, none stands for another kind of view than before, which it cannot cope with.
    fn next(&mut self, kind: &str, what: &str) -> (Uuid, String) {
        self.parts += 1;
        let hash = codec::hash(what.as_bytes()).to_be_bytes();
        let mut bytes = [0; 16];
        bytes[..6].copy_from_slice(&hash[..6]);
        // The two marks of a random identifier (RFC 9562, section 5.4), which the viewer's parser expects.
        (bytes[6], bytes[8], bytes[15]) = (0x40, 0x80, self.parts);
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let id = format!("{}-{}-{}-{}-{}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]);
        (Uuid { bytes }, format!("{kind}/{id}"))
    }
}

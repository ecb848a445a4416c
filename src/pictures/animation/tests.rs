//! The animation as a viewer sees it: decoded, and looked at where things must be.

use super::palette::{BACKGROUND, Colour, FORCE, GROUND, INK, LINE};
use super::stage::Stage;
use super::{AnimationError, Settings, View, animate, moments};
use crate::pictures::Film;
use nalgebra::Vector3;
use std::ops::ControlFlow;
use tumble::model::ContactModel;
use tumble::scene::Scene;
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::solver::native::NativeSolver;
use tumble::trajectory::{TrajectoryReader, TrajectoryWriter};

fn model(scene: &Scene) -> ContactModel {
    use tumble::{model::Parameters, scene};
    let usual = scene::tutorial_parameters().unwrap();
    let (gravity, time_step) = (scene.gravity, scene.time_step);
    ContactModel::new(Parameters { gravity, time_step, ..usual }).unwrap()
}

/// A drop or floating scene of `steps` steps.
fn film(scene: &Scene, floating: bool, steps: usize) -> Film {
    let model = model(scene);
    let motion = if floating {
        Motion::Floating
    } else {
        let solver = Box::new(NativeSolver::new(&model));
        Motion::Contact { detection: Default::default(), solver }
    };
    let start = scene.start(scene.attitude(42));
    let mut simulation = Simulation::new(model.clone(), start, motion).unwrap();
    let mut record = StepRecord::new(&start, 8);
    let mut writer = TrajectoryWriter::new(Vec::new(), 8, model.time_step()).unwrap();
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        writer.write(&record).unwrap();
    }
    simulation.end(&mut record);
    writer.write(&record).unwrap();
    let csv = writer.finish().unwrap();
    let mut reader = TrajectoryReader::new(&csv[..]).unwrap();
    let rows = std::iter::from_fn(|| reader.next_row().unwrap()).collect();
    Film { title: "a test".to_owned(), model, rows }
}

fn bytes(film: &Film, settings: &Settings) -> Vec<u8> {
    animate(film, settings, |_, _| ControlFlow::Continue(())).unwrap()
}

/// Every frame as the viewer has it, colours by rows.
fn pictures(bytes: &[u8], size: usize) -> Vec<Vec<Colour>> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let mut screen = vec![[0; 3]; size * size];
    let mut pictures = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (width, left) = (usize::from(frame.width), usize::from(frame.left));
        for (i, pixel) in frame.buffer.chunks_exact(4).enumerate() {
            let place = (usize::from(frame.top) + i / width) * size + left + i % width;
            if pixel[3] != 0 {
                screen[place] = [pixel[0], pixel[1], pixel[2]];
            }
        }
        pictures.push(screen.clone());
    }
    pictures
}

fn near(a: Colour, b: Colour) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 4)
}

fn has(picture: &[Colour], colour: Colour) -> bool {
    picture.iter().any(|&pixel| near(pixel, colour))
}

#[test]
fn the_body_is_where_the_trajectory_has_it() {
    let settings = Settings { size: 300, ..Settings::default() };
    for (scene, floating) in [(Scene::drop(), false), (Scene::floating(), true)] {
        let film = film(&scene, floating, 500);
        let moments = moments(&film, &settings).unwrap();
        let stage = Stage::new(&film, &settings, &moments).unwrap();
        let empty: Vec<_> = stage.empty().colours().collect();
        let pictures = pictures(&bytes(&film, &settings), 300);
        assert_eq!(pictures.len(), moments.len());
        for (moment, picture) in moments.iter().zip(&pictures) {
            let middle = moment.corners.iter().sum::<Vector3<f64>>() / 8.0;
            let [x, y] = stage.camera.project(&middle).map(|x| x as usize);
            let pixel = picture[y * 300 + x];
            for other in [BACKGROUND, GROUND, LINE, empty[y * 300 + x]] {
                assert!(!near(pixel, other), "{pixel:?} at {x}, {y}");
            }
            assert!(has(picture, INK));
            // Nothing is cut off: along the rim the picture is as without a body.
            for i in 0..300 {
                for place in [i, 299 * 300 + i, 300 * i, 300 * i + 299] {
                    assert!(near(picture[place], empty[place]));
                }
            }
        }
        // Arrows in the drop, once the cube has landed.
        assert_eq!(has(&pictures[pictures.len() - 1], FORCE), !floating);
        assert!(!has(&pictures[0], FORCE));
        // More ground than blends of the grid's lines may look like.
        let ground = pictures[0].iter().filter(|&&pixel| near(pixel, GROUND)).count();
        assert_eq!(ground > 9000, !floating, "{ground}");
    }
}

#[test]
fn one_row_is_one_frame() {
    let film = film(&Scene::drop(), false, 0);
    let pictures = pictures(&bytes(&film, &Settings { size: 120, ..Settings::default() }), 120);
    assert_eq!(pictures.len(), 1);
}

#[test]
fn other_views_and_other_bodies_are_drawn_too() {
    let mut film = film(&Scene::drop(), false, 300);
    let views = [(200.0, 0.0), (0.0, 90.0), (-720.0, 45.0)];
    for (azimuth, elevation) in views {
        let view = View { azimuth, elevation };
        let bytes = bytes(&film, &Settings { size: 120, view, speed: 10.0 });
        assert_eq!(pictures(&bytes, 120).len(), 3);
    }
    let body = film.model.body();
    let points = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vector3::from);
    let inertia = *body.inertia();
    let body = tumble::body::RigidBody::new(body.mass(), inertia, &points).unwrap();
    let parameters = tumble::model::Parameters { body, ..film.model.parameters().clone() };
    film.model = ContactModel::new(parameters).unwrap();
    let pictures = pictures(&bytes(&film, &Settings { size: 400, ..Settings::default() }), 400);
    assert!(has(&pictures[0], super::palette::EDGE));
}

#[test]
fn what_cannot_be_drawn_is_an_error() {
    let settings = Settings { size: 120, ..Settings::default() };
    let mut far = film(&Scene::drop(), false, 0);
    far.rows[0].state.position.x = 1e200;
    let go_on = |_, _| ControlFlow::Continue(());
    assert!(matches!(animate(&far, &settings, go_on), Err(AnimationError::TooFar)));
    let film = film(&Scene::drop(), false, 10);
    let slow = Settings { speed: 1e-4, ..settings };
    assert!(matches!(animate(&film, &slow, go_on), Err(AnimationError::TooLong { .. })));
    let stop = |_, _| ControlFlow::Break(());
    assert!(matches!(animate(&film, &settings, stop), Err(AnimationError::Interrupted)));
}

//! `tumble gif` and `--gif`: the decoded file, and refusals.

use assert_cmd::Command;
use std::fs;
use std::path::Path;
use std::process::Output;
use std::time::Duration;
use tempfile::TempDir;

type Colour = [u8; 3];

fn tumble(args: &[&str], directory: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tumble"));
    command.timeout(Duration::from_secs(600)).current_dir(directory);
    command.args(args).output().unwrap()
}

/// Standard output of a command that must succeed.
fn done(args: &[&str], directory: &Path) -> String {
    let output = tumble(args, directory);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Asserts exit code 2 and one sentence with `word`.
fn refused(args: &[&str], directory: &Path, word: &str) {
    let output = tumble(args, directory);
    let sentence = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {sentence}");
    assert!(output.stdout.is_empty());
    assert_eq!(sentence.matches('\n').count(), 1, "{sentence}");
    assert!(sentence.starts_with("error: ") && sentence.contains(word), "{sentence}");
}

/// Decoded file.
struct Animation {
    size: usize,
    /// Displayed pictures by frame, with colours by rows.
    pictures: Vec<Vec<Colour>>,
    /// Delays [hundredths of a second].
    delays: Vec<u16>,
    colours: usize,
}

impl Animation {
    fn decode(bytes: &[u8]) -> Self {
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        options.check_frame_consistency(true);
        let mut decoder = options.read_info(bytes).unwrap();
        assert_eq!(decoder.width(), decoder.height());
        assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
        let size = usize::from(decoder.width());
        let colours = decoder.global_palette().unwrap().len() / 3;
        let mut screen = vec![[0; 3]; size * size];
        let (mut pictures, mut delays) = (Vec::new(), Vec::new());
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            assert!(frame.palette.is_none() && frame.dispose == gif::DisposalMethod::Keep);
            let (width, left) = (usize::from(frame.width), usize::from(frame.left));
            for (i, pixel) in frame.buffer.chunks_exact(4).enumerate() {
                let place = (usize::from(frame.top) + i / width) * size + left + i % width;
                if pixel[3] != 0 {
                    screen[place] = [pixel[0], pixel[1], pixel[2]];
                }
            }
            pictures.push(screen.clone());
            delays.push(frame.delay);
        }
        Self { size, pictures, delays, colours }
    }

    fn open(path: &Path) -> Self {
        Self::decode(&fs::read(path).unwrap())
    }

    /// Duration [s].
    fn duration(&self) -> f64 {
        self.delays.iter().map(|&delay| f64::from(delay)).sum::<f64>() / 100.0
    }

    /// Centroid of the body's blue pixels, in shares of width and height.
    fn body(&self, frame: usize) -> [f64; 2] {
        let mut sum = [0.0; 3];
        for (i, [red, _, blue]) in self.pictures[frame].iter().enumerate() {
            if blue.saturating_sub(*red) > 30 {
                sum[0] += (i % self.size) as f64;
                sum[1] += (i / self.size) as f64;
                sum[2] += self.size as f64;
            }
        }
        assert!(sum[2] > 0.0, "no body in frame {frame}");
        [sum[0] * self.size as f64 / sum[2], sum[1] * self.size as f64 / sum[2]]
            .map(|middle| middle / self.size as f64)
    }
}

#[test]
fn a_drop_is_thirty_frames_a_second_at_real_speed_and_small() {
    let directory = TempDir::new().unwrap();
    let here = directory.path();
    let text = done(&["--steps", "1000", "--solver", "native", "--gif"], here);
    assert!(text.contains("wrote out/animation.gif"), "{text}");
    let bytes = fs::read(here.join("out/animation.gif")).unwrap();
    assert!(bytes.len() < 1_500_000, "{} bytes", bytes.len());
    let animation = Animation::decode(&bytes);
    assert_eq!((animation.size, animation.colours), (800, 128));
    // A run of 1.998 s has a frame every thirtieth of a second and one for the last row.
    assert_eq!(animation.pictures.len(), 61);
    assert!((animation.duration() - 61.0 / 30.0).abs() < 0.01);
    assert!(animation.delays.iter().all(|delay| (3..=4).contains(delay)));
    // The cube falls and moves to the right, the +y direction in the default view.
    let (first, last) = (animation.body(0), animation.body(60));
    assert!(last[0] > first[0] + 0.1 && last[1] > first[1] + 0.03, "{first:?} {last:?}");

    // The bytes do not depend on the output directory or on the source, run or file.
    done(&["gif", "out/states.csv", "--out", "new/place", "--quiet"], here);
    assert_eq!(fs::read(here.join("new/place/animation.gif")).unwrap(), bytes);
    fs::remove_file(here.join("out/animation.gif")).unwrap();
    assert!(done(&["gif", "out/states.csv"], here).starts_with("wrote out/animation.gif ("));
    assert_eq!(fs::read(here.join("out/animation.gif")).unwrap(), bytes);
}

#[test]
fn gif_has_the_requested_speed_size_and_camera() {
    let directory = TempDir::new().unwrap();
    let here = directory.path();
    done(&["--steps", "101", "--solver", "native", "--quiet"], here);
    let gif = |options: &[&str]| {
        let mut args = vec!["gif", "states.csv", "--gif-size", "160"];
        args.extend(options);
        done(&args, &here.join("out"));
        Animation::open(&here.join("out/animation.gif"))
    };
    let plain = gif(&[]);
    // A run of 0.2 s at real speed, five times slower and twice as fast.
    assert_eq!((plain.size, plain.pictures.len()), (160, 7));
    let slow = gif(&["--gif-speed", "0.2"]);
    assert_eq!(slow.pictures.len(), 31);
    assert!((slow.duration() - 31.0 / 30.0).abs() < 0.01);
    assert_eq!(gif(&["--gif-speed", "2"]).pictures.len(), 4);
    // The cube moves to the left in a view from the opposite side.
    let other = gif(&["--camera", "148,20"]);
    let way = |animation: &Animation| animation.body(6)[0] - animation.body(0)[0];
    assert!(way(&plain) > 0.0 && way(&other) < 0.0, "{} {}", way(&plain), way(&other));
    // A dark background.
    let dark = gif(&["--gif-dark"]);
    let brightness = |animation: &Animation| {
        animation.pictures[0].iter().flatten().map(|part| u64::from(*part)).sum::<u64>()
    };
    assert!(3 * brightness(&dark) < brightness(&plain));
    // The view from above is allowed.
    assert_eq!(gif(&["--camera", "0,90"]).pictures.len(), 7);
}

/// Without ground only the background is behind the body.
#[test]
fn gif_without_ground_draws_no_ground() {
    let directory = TempDir::new().unwrap();
    let here = directory.path();
    let flags = ["--gif", "--gif-size", "400", "--steps", "100", "--quiet"];
    let ground = |args: &[&str]| {
        done(&[args, &flags].concat(), here);
        let animation = Animation::open(&here.join("out/animation.gif"));
        let is_ground = |pixel: &&Colour| {
            pixel.iter().zip([0xe6, 0xea, 0xef]).all(|(a, b): (&u8, u8)| a.abs_diff(b) <= 4)
        };
        animation.pictures[0].iter().filter(is_ground).count()
    };
    let (with, without) =
        (ground(&["--solver", "native"]), ground(&["--scene", "floating", "--gravity", "9.81"]));
    // Blended pixels of grid lines may resemble the ground.
    assert!(with > 10_000 && 3 * without < with, "{with} {without}");
}

#[test]
fn one_row_and_the_floating_scene_are_drawn() {
    let directory = TempDir::new().unwrap();
    let here = directory.path();
    done(&["--steps", "1", "--gif", "--gif-size", "200", "--quiet"], here);
    let still = Animation::open(&here.join("out/animation.gif"));
    assert_eq!((still.pictures.len(), still.delays[0]), (1, 3));
    still.body(0);
    done(&["--scene", "floating", "--gif", "--gif-size", "200", "--quiet"], here);
    let floating = Animation::open(&here.join("out/animation.gif"));
    assert_eq!(floating.pictures.len(), 37);
    for frame in 0..37 {
        floating.body(frame);
    }
}

#[test]
fn the_animation_has_the_name_that_is_given() {
    let directory = TempDir::new().unwrap();
    let here = directory.path();
    done(&["--gif", "--gif-size", "120", "--steps", "100", "--quiet"], here);
    let made = |name: &str| fs::read(here.join(name)).unwrap();
    let gif = made("out/animation.gif");
    assert!(gif.starts_with(b"GIF89a"));
    for (out, written) in [("new/a.gif", "new/a.gif"), ("new", "new/animation.gif")] {
        let args = ["gif", "out/states.csv", "--gif-size", "120", "--out", out];
        assert!(done(&args, here).starts_with(&format!("wrote {written} (")), "{out}");
        assert!(made(written) == gif, "{out}");
    }
    // A directory may have any name.
    fs::create_dir(here.join("b.mp4")).unwrap();
    done(&["gif", "out/states.csv", "--gif-size", "120", "--out", "b.mp4"], here);
    assert!(made("b.mp4/animation.gif") == gif);
    // A run without animation removes the animation of the previous run.
    assert!(done(&["--steps", "3"], here).contains("removed animation.gif"));
}

#[test]
fn bad_options_and_files_end_with_code_2_and_leave_no_file() {
    let directory = TempDir::new().unwrap();
    let here = directory.path();
    done(&["--steps", "11", "--solver", "native", "--quiet"], here);
    let gif = |options: &[&str], word: &str| {
        let mut args = vec!["gif", "out/states.csv"];
        args.extend(options);
        refused(&args, here, word);
    };
    for speed in ["0", "-1", "nan", "1e5", "fast"] {
        gif(&["--gif-speed", speed], "--gif-speed");
    }
    for size in ["0", "99", "2001", "-5", "70000", "8.5"] {
        gif(&["--gif-size", size], "--gif-size");
    }
    for camera in ["1", "1,2,3", "0,-1", "0,91", "nan,1", "400,3"] {
        gif(&["--camera", camera], "--camera");
    }
    for out in ["x.avi", "new/x.mov", "x.png"] {
        gif(&["--out", out], "a file name that ends in .gif or .mp4 or .webm");
    }
    // 0.02 s at a speed of 1/10000.
    gif(&["--gif-speed", "0.0001"], "--gif-speed");
    refused(&["gif", "out/run.json"], here, "is not a table of the run");
    refused(&["gif", "nowhere.csv"], here, "nowhere.csv");
    assert!(!here.join("out/animation.gif").exists());
    // A simulation refuses at the start.
    for option in ["--gif-speed=2", "--gif-size=300", "--camera=1,2", "--gif-dark"] {
        let flag = option.split('=').next().unwrap();
        refused(&["--out", "other", option], here, flag);
    }
    refused(&["--out", "other", "--steps", "60000", "--gif"], here, "--gif-speed");
    refused(&["--out", "other", "--steps", "600000", "--gif", "--gif-speed", "99"], here, "rows");
    assert!(!here.join("other").exists());
    // Three tables, trajectory.csv, run.json and state.bin.
    assert_eq!(fs::read_dir(here.join("out")).unwrap().count(), 6);
}

//! Videos, encoded by the program ffmpeg.

use super::outcome::Failure;
use super::output::PendingFile;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Read as _, Seek as _, Write as _};
use std::process::{Child, Command, Stdio};
use tumble_model::shown;
use tumble_view::MARK;
use tumble_view::animation::FRAMES_A_SECOND;

/// Endings of videos. They are also names of formats of ffmpeg.
pub const ENDINGS: [&str; 2] = ["mp4", "webm"];

/// An even width and height, and the colours that players expect.
const FILTER: &str = "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,\
                      setparams=color_primaries=bt709:color_trc=bt709,format=yuv420p";

/// Encoder of a video under way. It is ended when dropped.
pub struct Video<'a> {
    file: &'a PendingFile,
    encoder: Child,
    /// Messages of the encoder.
    messages: File,
}

impl<'a> Video<'a> {
    /// Starts ffmpeg for frames of `size` by `size` pixels.
    pub fn start(file: &'a PendingFile, size: u16) -> Result<Self, Failure> {
        let name = file.name();
        let (_, ending) = name.rsplit_once('.').unwrap_or_default();
        let quality = if ending == "webm" { "-crf 30 -b:v 0" } else { "-movflags +faststart" };
        let input =
            format!("-f rawvideo -pix_fmt rgb24 -s {size}x{size} -r {FRAMES_A_SECOND} -i -");
        let output = format!("-vf {FILTER} {quality} -f {ending} -y -metadata");
        let mut path = OsString::from("file:");
        path.push(file.temporary_path());
        let kept = tempfile::tempfile().and_then(|file| Ok((file.try_clone()?, file)));
        let (messages, sink) = kept.map_err(|error| file.failed(&error))?;
        let mut command = Command::new("ffmpeg");
        command.args(["-hide_banner", "-loglevel", "error"]).args(input.split(' '));
        // The mark of a file that may be replaced.
        command.args(output.split(' ')).arg(format!("title={MARK}")).arg(path);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(sink);
        let encoder = command.spawn().map_err(|why| {
            Failure::Input(format!(
                "{name} needs the program ffmpeg, which does not start ({why}); install it, or \
                 choose a name that ends in .gif"
            ))
        })?;
        Ok(Self { file, encoder, messages })
    }

    /// Adds a frame.
    pub fn add(&mut self, pixels: &[u8]) -> io::Result<()> {
        self.encoder.stdin.as_mut().map_or(Ok(()), |input| input.write_all(pixels))
    }

    /// Waits for the end of the video. `is_complete` is false if ffmpeg refused a frame.
    pub fn finish(mut self, is_complete: bool) -> Result<(), Failure> {
        let status = self.encoder.wait().map_err(|error| self.file.failed(&error))?;
        if !is_complete || !status.success() {
            let mut messages = String::new();
            // Without a message the status has to do.
            let _ =
                self.messages.rewind().and_then(|()| self.messages.read_to_string(&mut messages));
            let name = self.file.name();
            let why = shown::line(messages.lines().next().unwrap_or("without a message"));
            let why = format!("{name} is not written: ffmpeg ended early ({status}): {why}");
            return Err(Failure::Other(why));
        }
        let file = self.file.open()?;
        file.sync_all().map_err(|error| self.file.failed(&error))
    }
}

impl Drop for Video<'_> {
    fn drop(&mut self) {
        // Both fail if it has ended.
        let _ = self.encoder.kill();
        let _ = self.encoder.wait();
    }
}

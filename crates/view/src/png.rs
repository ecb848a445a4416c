//! Pictures as PNG.

use resvg::tiny_skia::Pixmap;

/// Chunk of a PNG with the comment [`MARK`](crate::MARK): length, kind, keyword, text and checksum.
pub const COMMENT: &[u8] = b"\0\0\0\x19tEXtComment\0Written by tumble\x9e\xb9\x5d\xb5";
/// Length of the signature and of the first chunk of a PNG (bytes). Any other chunk may follow them.
pub const HEADER: usize = 33;

/// Encodes a picture as PNG with the mark of tumble.
///
/// # Errors
/// Failure of the encoder, in words.
pub fn marked(picture: &Pixmap) -> Result<Vec<u8>, String> {
    let mut png = picture.encode_png().map_err(|error| error.to_string())?;
    png.splice(HEADER..HEADER, COMMENT.iter().copied());
    Ok(png)
}

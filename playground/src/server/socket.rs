//! Conversation of a page with the program through a WebSocket.

use super::http::is_timeout;
use super::{PAUSE, Server, finish};
use crate::pull::Hand;
use crate::request::{Program, Request};
use std::io;
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

/// Size limit of a message (bytes): a scenario file of the largest size, with escapes.
pub const LARGEST_MESSAGE: usize = 8 << 20;
/// Maximum number of steps of a request. A page asks for those of a tenth of a second.
const MOST_STEPS: u32 = 100_000;

impl Server {
    /// Answers requests until the page goes or `end` is true. Then the page holds no body.
    pub(super) fn serve_requests(&self, stream: TcpStream, end: &AtomicBool) -> io::Result<()> {
        let hand = self.sockets.fetch_add(1, Ordering::Relaxed) + 1;
        let done = self.serve_requests_as(hand, stream, end);
        self.program().leave(hand);
        done
    }

    fn serve_requests_as(&self, hand: Hand, stream: TcpStream, end: &AtomicBool) -> io::Result<()> {
        stream.set_read_timeout(Some(PAUSE))?;
        let config = WebSocketConfig::default()
            .max_message_size(Some(LARGEST_MESSAGE))
            .max_frame_size(Some(LARGEST_MESSAGE));
        let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config));
        let (code, reason) = loop {
            if end.load(Ordering::Relaxed) {
                break (CloseCode::Away, "the run has ended");
            }
            match socket.read() {
                Ok(Message::Text(text)) => {
                    let mut request = Request::parse(text.as_bytes());
                    if let Ok(Request::Step { count, .. }) = &mut request {
                        if *count > MOST_STEPS {
                            request =
                                Err(format!("step: count is {count}; allowed: 0 to {MOST_STEPS}"));
                        } else if !self.step_ahead(count, socket.get_ref(), end)? {
                            return Ok(());
                        }
                    }
                    let answer = {
                        let mut program = self.program();
                        program.respond(hand, request);
                        message(&program)
                    };
                    match socket.send(Message::Binary(answer.into())) {
                        Ok(()) => {}
                        Err(_) => return Ok(()),
                    }
                }
                Ok(Message::Binary(_)) => {
                    break (CloseCode::Unsupported, "requests are text");
                }
                // Answers to pings and closings are sent with the next reading.
                Ok(_) => {}
                Err(Error::Io(error)) if is_timeout(&error) => {}
                Err(Error::Capacity(_)) => break (CloseCode::Size, "the message is too large"),
                Err(Error::Protocol(_)) => {
                    break (CloseCode::Protocol, "the message is malformed");
                }
                Err(Error::Utf8(_)) => break (CloseCode::Invalid, "the message is not UTF-8"),
                Err(_) => return Ok(()),
            }
        };
        close(socket, CloseFrame { code, reason: reason.into() }, end)
    }

    /// Takes the `left` steps of a request but the last one. In between, other windows get the
    /// program. No step is left once one of them has changed the scene, or at the end of the server.
    /// Returns false if the page has gone.
    fn step_ahead(&self, left: &mut u32, page: &TcpStream, end: &AtomicBool) -> io::Result<bool> {
        let described = self.program().described();
        while *left > 1 && !end.load(Ordering::Relaxed) {
            let (mut program, begin) = (self.program(), Instant::now());
            if program.described() != described {
                *left = 0;
            }
            while *left > 1 && begin.elapsed() < PAUSE {
                // The last step has the error of a step that fails.
                *left = if program.step().is_ok() { *left - 1 } else { 1 };
            }
            drop(program);
            if has_gone(page)? {
                return Ok(false);
            }
            // Without a pause this thread would get the program again before those that wait.
            thread::sleep(Duration::from_millis(1));
        }
        if end.load(Ordering::Relaxed) {
            *left = 0;
        }
        Ok(true)
    }
}

/// True if a page has closed its connection, or asks for that by the first frame to read.
fn has_gone(page: &TcpStream) -> io::Result<bool> {
    const CLOSING: u8 = 0x88;
    let mut next = [0];
    page.set_nonblocking(true)?;
    let length = page.peek(&mut next);
    page.set_nonblocking(false)?;
    Ok(match length {
        Ok(length) => length == 0 || next[0] == CLOSING,
        Err(error) => !is_timeout(&error),
    })
}

/// Answer of a program: length of its text (u32, little-endian), text, spaces up to a multiple of 8
/// bytes, numbers (f64, little-endian). `page/worker.js` reads it.
fn message(program: &Program) -> Vec<u8> {
    let mut message = Vec::with_capacity(16 + program.text.len() + 8 * program.numbers.len());
    message.extend((program.text.len() as u32).to_le_bytes());
    message.extend(program.text.bytes());
    message.resize(message.len().next_multiple_of(8), b' ');
    message.extend(program.numbers.iter().flat_map(|number| number.to_le_bytes()));
    message
}

/// Closes a socket with a reason.
fn close(mut socket: WebSocket<TcpStream>, frame: CloseFrame, end: &AtomicBool) -> io::Result<()> {
    let _ = socket.close(Some(frame));
    let _ = socket.flush();
    finish(socket.get_mut(), end)
}

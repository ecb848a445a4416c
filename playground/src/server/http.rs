//! The little of HTTP that the page needs: heads of requests, one page, refusals.

use super::PATIENCE;
use std::io::{self, ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tungstenite::handshake::derive_accept_key;

/// Size limit of a head (bytes), and maximum number of its fields.
const LARGEST_HEAD: usize = 16 << 10;
const MOST_FIELDS: usize = 64;

/// Status and reason of a refused request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    status: &'static str,
    reason: &'static str,
}

const fn refusal(status: &'static str, reason: &'static str) -> Refusal {
    Refusal { status, reason }
}

pub const MALFORMED: Refusal = refusal("400 Bad Request", "The request is not HTTP/1.1.");
pub const NO_TOKEN: Refusal = refusal(
    "403 Forbidden",
    "The address has no valid token. Copy the whole address that tumble printed.",
);
pub const FOREIGN_ORIGIN: Refusal =
    refusal("403 Forbidden", "The socket is only for the page of this server.");
pub const NOT_FOUND: Refusal = refusal("404 Not Found", "The server has no such page.");
pub const NOT_A_GET: Refusal = refusal("405 Method Not Allowed", "The server only answers GET.");
pub const TOO_SLOW: Refusal = refusal("408 Request Timeout", "The request took too long.");
pub const FOREIGN_HOST: Refusal =
    refusal("421 Misdirected Request", "The server has another name.");
pub const NO_UPGRADE: Refusal =
    refusal("426 Upgrade Required", "This address is a WebSocket of version 13.");
pub const TOO_LARGE: Refusal =
    refusal("431 Request Header Fields Too Large", "The head of the request is too large.");
pub const BUSY: Refusal = refusal("503 Service Unavailable", "There are too many connections.");

/// Head of a request.
#[derive(Debug)]
pub struct Head {
    pub method: String,
    pub path: String,
    /// Names in lower case, and values.
    fields: Vec<(String, String)>,
}

impl Head {
    /// Reads the head of a request until `end` is true. A body is not read. The reading of `stream`
    /// returns after a short time without bytes.
    pub fn read(stream: &mut impl Read, end: &AtomicBool) -> Result<Self, Refusal> {
        let (begin, mut bytes, mut part) = (Instant::now(), Vec::new(), [0; 1024]);
        loop {
            // Also for a client that sends a byte now and then.
            if begin.elapsed() > PATIENCE || end.load(Ordering::Relaxed) {
                return Err(TOO_SLOW);
            }
            let count = match stream.read(&mut part) {
                Ok(count) => count,
                Err(error) if is_timeout(&error) => continue,
                Err(_) => return Err(MALFORMED),
            };
            bytes.extend_from_slice(&part[..count]);
            if let Some(head) = Self::parsed(&bytes)? {
                return Ok(head);
            }
            if bytes.len() > LARGEST_HEAD {
                return Err(TOO_LARGE);
            }
            if count == 0 {
                return Err(MALFORMED);
            }
        }
    }

    /// Head of these bytes; `None` if it is not complete.
    fn parsed(bytes: &[u8]) -> Result<Option<Self>, Refusal> {
        let mut fields = [httparse::EMPTY_HEADER; MOST_FIELDS];
        let mut request = httparse::Request::new(&mut fields);
        let status = request.parse(bytes).map_err(|error| match error {
            httparse::Error::TooManyHeaders => TOO_LARGE,
            _ => MALFORMED,
        })?;
        if status.is_partial() {
            return Ok(None);
        }
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let fields = request.headers.iter();
        let fields = fields.map(|field| (field.name.to_ascii_lowercase(), text(field.value)));
        Ok(Some(Self {
            method: request.method.unwrap_or_default().to_owned(),
            path: request.path.unwrap_or_default().to_owned(),
            fields: fields.collect(),
        }))
    }

    /// Value of the only field of this name, in lower case.
    pub fn field(&self, name: &str) -> Option<&str> {
        let mut found = self.fields.iter().filter(|(other, _)| other == name);
        let (_, value) = found.next()?;
        found.next().is_none().then_some(value.as_str())
    }
}

/// Sends the page.
pub fn send_page(stream: &mut impl Write, page: &str) -> io::Result<()> {
    send(stream, "200 OK", "text/html", page)
}

/// Sends a refusal.
pub fn refuse(stream: &mut impl Write, refusal: Refusal) -> io::Result<()> {
    let Refusal { status, reason } = refusal;
    send(stream, status, "text/plain", &format!("{status}. {reason}\n"))
}

fn send(stream: &mut impl Write, status: &str, kind: &str, content: &str) -> io::Result<()> {
    let length = content.len();
    // The token stays in this address: it is neither stored nor sent to other servers.
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {length}\r\n\
         Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(content.as_bytes())
}

/// Accepts a socket with the key of its request.
pub fn accept_socket(stream: &mut impl Write, key: &str) -> io::Result<()> {
    let accept = derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {accept}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())
}

/// True if nothing came within the time of a read.
pub fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}

//! Server of the page on this machine: the program runs natively, the browser draws.
//!
//! The address of the page has a random token. Who does not know it gets neither the page nor the
//! socket. A request of the socket is one of [`crate::request`]. Several windows share one program.

mod http;
mod socket;

use crate::page::live_page;
use crate::request::Program;
use http::{Head, Refusal};
use std::fmt::Write as _;
use std::io::{self, Read as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Time between two looks at the listener and at the flag that ends the server.
const PAUSE: Duration = Duration::from_millis(20);
/// Time for the head of a request, and for the sending of an answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Maximum number of connections at the same time.
const MOST_CONNECTIONS: usize = 32;
/// Number of random bytes in the token.
const TOKEN_BYTES: usize = 16;

/// A server of one program.
pub struct Server {
    listener: TcpListener,
    /// Names of the server in the head of a request.
    hosts: Vec<String>,
    token: String,
    page: String,
    program: Mutex<Program>,
    /// Number of sockets so far.
    sockets: AtomicU64,
    connections: AtomicUsize,
}

impl Server {
    /// Server at an address of this machine, with a free port for the port 0.
    ///
    /// # Errors
    /// An address that is not of this machine, or of all its interfaces; a port in use.
    pub fn bind(address: SocketAddr, program: Program) -> io::Result<Self> {
        if address.ip().is_unspecified() {
            let why = "it stands for all interfaces; give the address of one";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, why));
        }
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let mut hosts = vec![address.to_string()];
        if address.ip().is_loopback() {
            hosts.push(format!("localhost:{}", address.port()));
        }
        let page = live_page(&hosts).map_err(io::Error::other)?;
        let (program, token) = (Mutex::new(program), token()?);
        let (sockets, connections) = (AtomicU64::new(0), AtomicUsize::new(0));
        Ok(Self { listener, hosts, token, page, program, sockets, connections })
    }

    /// Address of the page.
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.hosts[0], self.token)
    }

    /// Serves until `end` is true.
    pub fn serve(&self, end: &AtomicBool) {
        thread::scope(|scope| {
            while !end.load(Ordering::Relaxed) {
                let Ok((stream, _)) = self.listener.accept() else {
                    thread::sleep(PAUSE);
                    continue;
                };
                // A browser that went away is no failure of the server.
                if self.connections.load(Ordering::Relaxed) >= MOST_CONNECTIONS {
                    let _ = refuse_busy(stream);
                    continue;
                }
                self.connections.fetch_add(1, Ordering::Relaxed);
                scope.spawn(move || {
                    let _ = self.answer(stream, end);
                    self.connections.fetch_sub(1, Ordering::Relaxed);
                });
            }
        });
    }

    /// The program. Requests wait while it is in use.
    pub fn program(&self) -> MutexGuard<'_, Program> {
        self.program.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers the request of a connection.
    fn answer(&self, mut stream: TcpStream, end: &AtomicBool) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PAUSE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        match Head::read(&mut stream, end).and_then(|head| self.target_of(&head)) {
            Ok(RequestTarget::Page) => http::send_page(&mut stream, &self.page),
            Ok(RequestTarget::Socket { key }) => {
                http::accept_socket(&mut stream, &key)?;
                self.serve_requests(stream, end)
            }
            Err(refusal) => {
                http::refuse(&mut stream, refusal)?;
                finish(&mut stream, end)
            }
        }
    }

    /// Requested content, if the request is allowed.
    fn target_of(&self, head: &Head) -> Result<RequestTarget, Refusal> {
        if head.method != "GET" {
            return Err(http::NOT_A_GET);
        }
        // A foreign name that points to this machine is that of a foreign page.
        let host = head.field("host").ok_or(http::MALFORMED)?;
        if !self.hosts.iter().any(|own| own == host) {
            return Err(http::FOREIGN_HOST);
        }
        let path = head.path.strip_prefix('/').and_then(|path| path.split_once('/'));
        let Some((_, place)) = path.filter(|(token, _)| *token == self.token) else {
            return Err(http::NO_TOKEN);
        };
        match place {
            "" => Ok(RequestTarget::Page),
            "live" => {
                if head.field("origin") != Some(&format!("http://{host}")) {
                    return Err(http::FOREIGN_ORIGIN);
                }
                let is_socket = |value: &str| value.eq_ignore_ascii_case("websocket");
                let key = head.field("sec-websocket-key");
                let key = key.filter(|_| head.field("upgrade").is_some_and(is_socket));
                let key = key.filter(|_| head.field("sec-websocket-version") == Some("13"));
                let key = key.ok_or(http::NO_UPGRADE)?.to_owned();
                Ok(RequestTarget::Socket { key })
            }
            _ => Err(http::NOT_FOUND),
        }
    }
}

/// Content of the server.
enum RequestTarget {
    Page,
    Socket { key: String },
}

/// Ends a connection after its last answer. What still comes is read and dropped for a while, since
/// the system discards the answer if bytes remain.
fn finish(stream: &mut TcpStream, end: &AtomicBool) -> io::Result<()> {
    stream.shutdown(Shutdown::Write)?;
    let (begin, mut rest) = (Instant::now(), vec![0; 1 << 16]);
    while begin.elapsed() < PATIENCE / 5 && !end.load(Ordering::Relaxed) {
        match stream.read(&mut rest) {
            Ok(0) => break,
            Err(error) if !http::is_timeout(&error) => return Err(error),
            _ => {}
        }
    }
    Ok(())
}

/// Refuses a connection beyond [`MOST_CONNECTIONS`], without a thread of its own.
fn refuse_busy(mut stream: TcpStream) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_write_timeout(Some(PAUSE))?;
    http::refuse(&mut stream, http::BUSY)?;
    stream.shutdown(Shutdown::Write)
}

/// Random token in hexadecimal digits.
fn token() -> io::Result<String> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    let mut token = String::new();
    for byte in bytes {
        let _ = write!(token, "{byte:02x}");
    }
    Ok(token)
}

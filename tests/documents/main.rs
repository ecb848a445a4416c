//! What the documents say: their links, and the equations that the code cites.

mod citations;
mod links;

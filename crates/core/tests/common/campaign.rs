//! Sizes of campaigns.

/// Size of a campaign: `long` if the environment variable `TUMBLE_LONG` is set, otherwise `short`.
pub fn size(short: usize, long: usize) -> usize {
    if std::env::var_os("TUMBLE_LONG").is_some() { long } else { short }
}

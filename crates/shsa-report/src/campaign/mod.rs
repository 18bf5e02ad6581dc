//! The results of a campaign of faults (`shsa_lab::campaign`): as text, as Markdown, and as a page with heat maps.

mod text;
mod page;
mod markdown;

pub use markdown::markdown;
pub use page::page;
pub use text::text;

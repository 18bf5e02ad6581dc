//! Track association: which tracks of several sensors are of one object.
//!
//! The tracks of all sensors are predicted to one moment. The tracks of the first sensor are objects; those of each further sensor are
//! assigned to these objects by global nearest neighbour: the assignment of least Mahalanobis distance within a gate. A track without a
//! partner is an object of its own. Of all objects one is chosen, and kept while it is there, so that its positions by the sensors can be
//! compared over time.
//!
//! Source: Y. Bar-Shalom, P. K. Willett, X. Tian, *Tracking and Data Fusion*, 2011, chapter 9; the example of roads is chapter 2 of
//! D. Ratasich, *Self-Healing Cyber-Physical Systems*, TU Wien 2019.

mod assignment;
mod counts;
mod objects;
mod region;
mod associator;

pub use assignment::assign;
pub use associator::{Associated, Associator, Settings};
pub use objects::{Member, Object, Sensor, TRACKS_MAX, Track};
pub use region::Region;

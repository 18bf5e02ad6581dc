//! Knowledge bases as ontologies in Turtle, by the vocabularies SOSA and SSN.
//!
//! | here | there |
//! |---|---|
//! | variable | `sosa:ObservableProperty`, its unit as `schema:unitText`, a vector with `shsa:shape` |
//! | constant | the same with `schema:value` |
//! | signal | `sosa:Sensor` that `sosa:observes` the variable |
//! | common cause | `sosa:Platform` that `sosa:hosts` the signals |
//! | relation, for each output | `sosa:Procedure` with `ssn:hasInput` and `ssn:hasOutput`, its equation as `shsa:equation` |
//!
//! K. Janowicz, A. Haller, S. J. D. Cox, D. Le Phuoc, M. Lefrançois, "SOSA: A lightweight ontology for sensors, observations, samples,
//! and actuators", 2019, doi:10.1016/j.websem.2018.06.003; A. Haller et al., "Semantic Sensor Network Ontology", W3C Recommendation, 2017.

mod graph;
mod read;
mod write;

pub use write::write;

pub(super) use read::draft;

const SOSA: &str = "http://www.w3.org/ns/sosa/";
const SSN: &str = "http://www.w3.org/ns/ssn/";
const RDFS: &str = "http://www.w3.org/2000/01/rdf-schema#";
/// Both are in use; the first one is written.
const SCHEMAS: [&str; 2] = ["https://schema.org/", "http://schema.org/"];
/// What the others have no word for.
const OWN: &str = "urn:shsa:ontology#";

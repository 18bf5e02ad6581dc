//! How a model rates substitutions: what stands under `utility:`.

/// How substitutions are rated; higher is better.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Utility {
    /// `(0.3/n + 0.5/cost + 0.1/(u+1) + 0.5*A) / 1.4` for each relation, multiplied: few inputs, low cost, few inputs
    /// that must be substituted themselves, exact inputs (Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien
    /// 2019, chapter 6).
    #[default]
    Norm,
}

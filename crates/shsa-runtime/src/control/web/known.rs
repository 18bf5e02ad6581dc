//! The models for the pages: fetched from the run once for each version, and examined in threads that decide nothing.

use super::super::Request;
use super::super::http::{Shared, ask};
use super::what_if::Examined;
use std::collections::BTreeMap;
use std::sync::Arc;
use tokio::sync::{Mutex, oneshot};
use tokio::task::spawn_blocking;

/// The models by name.
#[derive(Clone, Default)]
pub(super) struct Known(Arc<Mutex<BTreeMap<String, Arc<Examined>>>>);

impl Known {
    /// A model in its present version; `None` where there is none of this name, or the run is ending.
    pub(super) async fn model(&self, shared: &Shared, name: &str) -> Option<Arc<Examined>> {
        let version = shared.pages.board.lock().await.version(name);
        // Other readers wait for the same answer.
        let mut models = self.0.lock().await;
        let known = models.get(name).filter(|it| Some(it.knowledge().version()) == version);
        if let Some(known) = known {
            return Some(known.clone());
        }
        let (sender, receiver) = oneshot::channel();
        ask(shared, Request::Model(name.to_owned(), sender)).await.ok()?;
        let knowledge = receiver.await.ok()?;
        let model = Arc::new(spawn_blocking(|| Examined::new(*knowledge)).await.ok()?);
        models.insert(name.to_owned(), model.clone());
        Some(model)
    }
}

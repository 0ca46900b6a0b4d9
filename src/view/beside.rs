//! Threads beside the window, for what would stop it.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// A thread that carries out orders, seen from the window. Only its newest answer is kept.
pub(super) struct Beside<Order, Answer> {
    name: &'static str,
    orders: Option<Sender<Order>>,
    newest: Arc<Mutex<Option<Answer>>>,
    thread: Option<JoinHandle<()>>,
}

impl<Order: Send + 'static, Answer: Send + 'static> Beside<Order, Answer> {
    /// Starts the thread. `work` is to return when there are no more orders. `notify` is called
    /// after each answer, on that thread.
    pub(super) fn start(
        name: &'static str,
        work: impl FnOnce(&Receiver<Order>, &dyn Fn(Answer)) + Send + 'static,
        notify: Box<dyn Fn() + Send>,
    ) -> std::io::Result<Self> {
        let (orders, receiver) = channel();
        let newest = Arc::new(Mutex::new(None));
        let shared = Arc::clone(&newest);
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                work(&receiver, &|answer| {
                    *shared.lock().unwrap_or_else(PoisonError::into_inner) = Some(answer);
                    notify();
                });
            })?;
        Ok(Beside {
            name,
            orders: Some(orders),
            newest,
            thread: Some(thread),
        })
    }

    /// Asks for something after all that was asked for before.
    pub(super) fn ask(&self, order: Order) {
        if let Some(orders) = &self.orders {
            // A thread that panicked is told of when the window closes.
            let _ = orders.send(order);
        }
    }

    /// The newest answer, if it was not taken before.
    pub(super) fn take(&self) -> Option<Answer> {
        self.newest
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }
}

impl<Order, Answer> Drop for Beside<Order, Answer> {
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            log::error!("the thread of the {} panicked", self.name);
        }
    }
}

//! The two ends of a queue between the tick and the background.

/// The end things go into.
pub trait Sender<T> {
    /// Puts one in; gives it back if there is no room.
    ///
    /// # Errors
    /// The thing itself.
    fn send(&mut self, thing: T) -> Result<(), T>;

    /// Things that wait.
    fn waiting(&self) -> usize;
}

/// The end things come out of.
pub trait Receiver<T> {
    /// The oldest one.
    fn receive(&mut self) -> Option<T>;

    /// Things that wait.
    fn waiting(&self) -> usize;
}

impl<T> Sender<T> for heapless::spsc::Producer<'_, T> {
    #[inline]
    fn send(&mut self, thing: T) -> Result<(), T> {
        self.enqueue(thing)
    }

    fn waiting(&self) -> usize {
        self.len()
    }
}

impl<T> Receiver<T> for heapless::spsc::Consumer<'_, T> {
    #[inline]
    fn receive(&mut self) -> Option<T> {
        self.dequeue()
    }

    #[inline]
    fn waiting(&self) -> usize {
        self.len()
    }
}

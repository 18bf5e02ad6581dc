//! The end of a file: what of it is lost, whether its stamps are usable, where its clock was set.

use super::super::clock::{Division, Receptions, Step, divide};
use super::super::session::Piece;
use super::super::{Place, Sample};
use super::{Destination, Gathered};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

impl Gathered {
    /// Ends the current file: reports how much of it is lost, and splits it where its clock was set.
    pub(crate) fn end(&mut self) {
        self.judge_stamps();
        if let Some(problem) = std::mem::take(&mut self.room).problem() {
            self.damaged(Place::Whole, problem);
        }
        match self.destination {
            Destination::Kept => self.take_apart(),
            Destination::Surveyed(_) => self.survey_pieces(),
            Destination::Timed(_) | Destination::Sent(_) => {}
        }
        if let Some(last) = self.last_untold.take() {
            self.recording.warnings.push(last);
            self.warn(Place::Whole, format!("{} places in all are damaged", self.damages));
        }
        self.damages = 0;
        self.files += 1;
    }

    /// Replaces unusable stamps by times of reception, with a warning for each signal.
    fn judge_stamps(&mut self) {
        let mut flaws: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut unstamped = BTreeSet::new();
        for (wanted, (stream, found)) in self.streams.iter().zip(&mut self.recording.found).enumerate() {
            match stream.stamps.flaw().filter(|_| !stream.is_stamp_chosen && !stream.is_believed) {
                None => found.backward += stream.stamps.backward,
                Some(flaw) => {
                    unstamped.insert(wanted);
                    flaws.entry(flaw).or_default().push(stream.signal.clone());
                }
            }
        }
        if !unstamped.is_empty() {
            let all = self.recording.samples.iter_mut();
            all.filter(|sample| unstamped.contains(&sample.wanted))
                .for_each(|sample| sample.time = sample.received);
        }
        for (flaw, signals) in flaws {
            let signals = signals.join(", ");
            self.warn(
                Place::Whole,
                format!("signal {signals}: {flaw}; the time of reception is taken for them"),
            );
        }
        if matches!(self.destination, Destination::Surveyed(_)) {
            self.unstamped.push(unstamped);
        }
    }

    fn take_apart(&mut self) {
        let samples = std::mem::take(&mut self.recording.samples);
        let division = divide(&samples[..]);
        self.report_strays(&division);
        let mut pieces = self.new_pieces(&division);
        match (pieces.as_mut_slice(), division.is_whole()) {
            ([only], true) => only.take(samples),
            _ => self.deal_out(samples, &division, &mut pieces),
        }
        self.pieces.extend(pieces);
    }

    /// Gives each piece its samples.
    fn deal_out(&mut self, samples: Vec<Sample>, division: &Division, pieces: &mut [Piece]) {
        let mut dealt: Vec<Vec<Sample>> = pieces.iter().map(|_| Vec::new()).collect();
        for (sample, of) in samples.into_iter().zip(division.pieces()) {
            match of.and_then(|of| dealt.get_mut(of)) {
                Some(dealt) => dealt.push(sample),
                None => self.lose(sample.wanted),
            }
        }
        pieces.iter_mut().zip(dealt).for_each(|(piece, samples)| piece.take(samples));
    }

    /// The pieces of the current file, whose samples are not kept.
    fn survey_pieces(&mut self) {
        let piece = std::mem::take(&mut self.piece);
        let Some((division, receptions)) = self.division.take() else {
            let piece = Piece { file: self.files, path: self.file.clone(), parts: [0].into(), ..piece };
            self.pieces.push(piece);
            return self.divisions.push(None);
        };
        self.report_strays(&division);
        let mut pieces = self.new_pieces(&division);
        receptions.each(|place, wanted, received| {
            match division.piece_of(place).and_then(|of| pieces.get_mut(of)) {
                Some(piece) => piece.see(wanted, received),
                None => self.lose(wanted),
            }
        });
        self.pieces.extend(pieces);
        self.divisions.push(Some(Arc::new(division)));
    }

    fn new_pieces(&self, division: &Division) -> Vec<Piece> {
        let piece = |(number, step): (usize, &Option<Step>)| Piece {
            file: self.files,
            path: self.file.clone(),
            parts: [number].into(),
            step: *step,
            ..Piece::default()
        };
        division.steps.iter().enumerate().map(piece).collect()
    }

    fn report_strays(&mut self, division: &Division) {
        if !division.strays.is_empty() {
            let left_out = "received at times that are off by hours from those before and after: left out";
            self.damaged(Place::Whole, format!("{} samples {left_out}", division.strays.len()));
        }
    }

    /// Takes back the count of a sample whose time is wrong.
    fn lose(&mut self, wanted: usize) {
        self.recording.found.get_mut(wanted).into_iter().for_each(|found| found.samples -= 1);
    }
}

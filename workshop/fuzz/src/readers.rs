//! Readers of recordings, one target each: any bytes as a file of the format; results are in order, counted, and among the wanted
//! ones.

use crate::recordings::{check, parquet_writer};
use shsa_recording::ReadOptions;
use std::fs;

/// ULog of PX4.
pub mod ulog {
    use super::*;

    /// Reads the bytes as a log.
    pub fn run(bytes: &[u8]) {
        let sources = ["a#x", "a[1]#list", "a[0]#list[1]@timestamp*1us", "gps#fix_type!changed"];
        check("log.ulg", bytes, &sources, &ReadOptions::default());
    }

    /// A log with a list, nested formats, a fix, a dropout.
    #[must_use]
    pub fn seeds() -> Vec<Vec<u8>> {
        let message = |kind: u8, content: &[u8]| {
            let size = u16::try_from(content.len()).unwrap_or(0).to_le_bytes();
            [&size[..], &[kind], content].concat()
        };
        let data = |id: u8, time_us: u64, rest: &[u8]| {
            message(b'D', &[&[id, 0][..], &time_us.to_le_bytes(), rest].concat())
        };
        let parts = [
            [b"ULog\x01\x12\x35\x01".to_vec(), vec![0; 8]].concat(),
            message(b'B', &[0; 40]),
            message(b'F', b"b:int16_t u;uint8_t[3] v;"),
            message(b'F', b"a:uint64_t timestamp;float x;int16_t[2] list;b[2] inner;uint8_t[2] _padding0;"),
            message(b'F', b"gps:uint64_t timestamp;uint64_t time_utc_usec;uint8_t fix_type;"),
            message(b'I', b"\x0achar[3] verabc"),
            message(b'A', b"\0\0\0a"),
            message(b'A', b"\x01\x01\0a"),
            message(b'A', b"\0\x02\0gps"),
            data(0, 1_000, &[7; 18]),
            data(2, 2_000, &[&1_700_000_000_000_000_u64.to_le_bytes()[..], &[3]].concat()),
            data(1, 3_000, &[9; 20]),
            message(b'O', &[50, 0]),
            message(b'S', &[0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12]),
            data(0, 4_000, &[1; 18]),
        ];
        vec![parts.concat()]
    }
}

/// DataFlash of ArduPilot, binary, as text or as `mavlogdump` prints it; the first byte chooses.
pub mod dataflash {
    use super::*;

    const TEXT: &str = "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n\
FMT, 200, 18, IMU, QBfc, TimeUS,I,GyrZ,Roll\nFMT, 201, 17, GPS, QIH, TimeUS,GMS,GWk\n\
UNIT, 0, 115, s\nMULT, 0, 70, 1e-06\nFMTU, 0, 200, s#--, F---\n\
IMU, 1000000, 0, 0.5, -25.5\nGPS, 2000000, 38980800, 1966\nIMU, 3000000, 1, 0.25, 0.1\n";

    const DUMP: &str = "2017-09-10 10:49:22.70: FMT {Type : 200, Length : 18, Name : IMU, Format : QBfc, Columns : TimeUS,I,GyrZ,Roll}\n\
2017-09-10 10:49:22.70: FMTU {TimeUS : 0, FmtType : 200, UnitIds : s#--, MultIds : F---}\n\
2017-09-10 10:49:22.70: IMU {TimeUS : 1000000, I : 1, GyrZ : qnan, Roll : -25.5} srcSystem=1 seq=2\n\
{\"meta\": {\"type\": \"IMU\", \"timestamp\": 1505040562.7}, \"data\": {\"TimeUS\": 1000000, \"I\": 1, \"GyrZ\": NaN, \"Roll\": [1, 2]}}\n\
2017-09-10 10:49:22.80: GPS {TimeUS : 2000000, GMS : 38980800, GWk : 1966}\n";

    /// Reads the rest of the bytes as a log.
    pub fn run(bytes: &[u8]) {
        let (kind, bytes) = bytes.split_first().unwrap_or((&0, &[]));
        let sources = ["IMU#GyrZ", "IMU[1]#Roll", "GPS#GWk@TimeUS*1us", "FMT#Length[Name=IMU]"];
        check(
            ["log.bin", "text.log", "dump.log"][usize::from(kind % 3)],
            bytes,
            &sources,
            &ReadOptions::default(),
        );
    }

    /// A log of two kinds of messages with units.
    #[must_use]
    pub fn seeds() -> Vec<Vec<u8>> {
        let message = |kind: u8, content: &[u8]| [&[0xa3, 0x95, kind][..], content].concat();
        let padded =
            |text: &str, to: usize| [text.as_bytes(), &vec![0; to.saturating_sub(text.len())]].concat();
        let format = |kind: u8, length: u8, name: &str, characters: &str, columns: &str| {
            message(
                128,
                &[vec![kind, length], padded(name, 4), padded(characters, 16), padded(columns, 64)].concat(),
            )
        };
        let parts = [
            format(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
            format(200, 18, "IMU", "QBfc", "TimeUS,I,GyrZ,Roll"),
            format(201, 17, "GPS", "QIH", "TimeUS,GMS,GWk"),
            format(202, 76, "UNIT", "QbZ", "TimeUS,Id,Label"),
            format(204, 44, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds"),
            message(202, &[vec![0; 8], vec![b's'], padded("s", 64)].concat()),
            message(204, &[vec![0; 8], vec![200], padded("s#", 16), padded("--", 16)].concat()),
            message(200, &[1; 15]),
            message(
                201,
                &[&2_000_000_u64.to_le_bytes()[..], &38_980_800_u32.to_le_bytes(), &1966_u16.to_le_bytes()]
                    .concat(),
            ),
            message(200, &[2; 15]),
        ];
        let texts = [[b"\x01", TEXT.as_bytes()].concat(), [b"\x02", DUMP.as_bytes()].concat()];
        [&[[vec![0], parts.concat()].concat()][..], &texts].concat()
    }
}

/// Frames of a CAN bus with a DBC; the first byte chooses the form, the next two give the length of the DBC.
pub mod can {
    use super::*;

    const DBC: &str = "BO_ 23 speed: 8 X\n SG_ S : 8|16@1+ (0.5,-1) [0|1] \"m\" X\n SG_ M M : 7|4@0- (1,0) [0|1] \"\" X\n\
 SG_ A m1 : 8|8@1- (1,0) [0|1] \"\" X\n SG_ B m2M : 8|64@1- (1,0) [0|1] \"\" X\nSIG_VALTYPE_ 23 B : 2;\nSG_MUL_VAL_ 23 A B 1-2, 5-6;\n";
    const CANDUMP: &str = "(1700000000.5) can0 017#01E803AABBCCDDEE R\n(1700000001.5)  can0  017   [2]  01 02\n(1700000002.5) can1 00000017##1AABB\n";
    const ASC: &str = "date Wed Jan 11 05:42:09.103 pm 2023\nbase hex  timestamps absolute\n 0.1 1 17 Rx d 3 01 E8 03\n 0.3 CANFD 1 Rx 17x speed 1 0 3 3 01 D0 07\n 0.4 1 17 Rx d c 00 01 02 03 04 05 06 07 08 09 0A 0B\n";

    /// Reads the rest of the bytes as the DBC and the frames.
    pub fn run(bytes: &[u8]) {
        let [kind, low, high, rest @ ..] = bytes else { return };
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(rest.len());
        let (dbc, frames) = rest.split_at(length);
        let file = std::env::temp_dir().join(format!("shsa-fuzz-{}.dbc", std::process::id()));
        if fs::write(&file, dbc).is_err() {
            return;
        }
        let sources = ["speed#S", "0x17:speed#B[channel=can0]", "0x17#data[1]", "speed#A[S=1]"];
        let name = ["log.log", "log.asc", "log.blf"][usize::from(kind % 3)];
        check(name, frames, &sources, &ReadOptions { dbc: vec![file], ..ReadOptions::default() });
    }

    /// Frames in each form.
    #[must_use]
    pub fn seeds() -> Vec<Vec<u8>> {
        let object = |kind: u32, content: &[u8]| {
            let length = u32::try_from(16 + content.len()).unwrap_or(0);
            [b"LOBJ", &[32, 0, 1, 0][..], &length.to_le_bytes(), &kind.to_le_bytes(), content].concat()
        };
        let header = [&1_u32.to_le_bytes()[..], &[0; 4], &50_u64.to_le_bytes()].concat();
        let frame =
            object(1, &[&header, &[1, 0, 0, 3, 23, 0, 0, 0][..], &[1, 0xe8, 3, 0, 0, 0, 0, 0]].concat());
        // Not compressed, because changes of compressed bytes would only break zlib.
        let container = object(10, &[&[0; 16][..], &frame, &frame].concat());
        let blf = [b"LOGG", &144_u32.to_le_bytes()[..], &[0; 136], &container, &frame].concat();
        let length = u16::try_from(DBC.len()).unwrap_or(0).to_le_bytes();
        let seed = |kind: u8, frames: &[u8]| [&[kind][..], &length, DBC.as_bytes(), frames].concat();
        vec![seed(0, CANDUMP.as_bytes()), seed(1, ASC.as_bytes()), seed(2, &blf)]
    }
}

/// NMEA 0183.
pub mod nmea {
    use super::*;

    /// Reads the bytes as lines.
    pub fn run(bytes: &[u8]) {
        let sources =
            ["RMC#speed", "GPRMC#latitude", "DPT#depth", "XDR#value[name=T]", "GGA#altitude@received"];
        check("log.nmea", bytes, &sources, &ReadOptions::default());
    }

    /// Sentences with and without checksums, with prefixes.
    #[must_use]
    pub fn seeds() -> Vec<Vec<u8>> {
        let texts = [
            "$SDDPT,2.58,0.00,100.0*5B\r\n$GPRMC,190315.000,A,3503.8851,N,07658.0729,W,0.27,27.56,120816,,,A*4D\r\n",
            "$IIXDR,C,19.5,C,T,P,1.02,B,B\n$GPZDA,190316,12,08,2016,00,00\n$GPGGA,235959,3503.8,N,07658.0,W,1,8,0.9,5,M,,M,,\n$GPDPT,1\n",
            "\\c:1423133048*5F\\$SDDPT,2.58,0.00,100.0*5B\n2021-01-18T10:00:00Z;N;$SDDPT,2.58,0.00,100.0*5B\n",
        ];
        texts.iter().map(|text| text.as_bytes().to_vec()).collect()
    }
}

/// Signal K.
pub mod signalk {
    use super::*;

    /// Reads the bytes as deltas.
    pub fn run(bytes: &[u8]) {
        let sources = ["a.b", "a.b#x", "a.b[source=gps]", "c#0[context=vessels.self]@received"];
        // Without this first line, the bytes would be ordinary JSON lines.
        let head = br#"{"updates":[{"values":[]}]}"#;
        check("log.jsonl", &[&head[..], b"\n", bytes].concat(), &sources, &ReadOptions::default());
    }

    /// Deltas of two sources.
    #[must_use]
    pub fn seeds() -> Vec<Vec<u8>> {
        let text = "{\"updates\":[{\"source\":{\"label\":\"gps\"},\"timestamp\":\"2016-04-12T17:25:52Z\",\"values\":[{\"path\":\"a.b\",\"value\":1.5}]}]}\n\
1471172400153;A;{\"context\":\"vessels.x\",\"updates\":[{\"$source\":\"n\",\"values\":[{\"path\":\"a.b\",\"value\":{\"x\":[1]}},{}]}]}\n\
{\n\"updates\": [{\"values\": [\n{\"path\": \"a.b\", \"value\": 2}]}\n]}\n";
        vec![text.as_bytes().to_vec()]
    }
}

/// InfluxDB line protocol.
pub mod influx {
    use super::*;

    /// Reads the bytes as points.
    pub fn run(bytes: &[u8]) {
        let sources = ["room#temperature", "room#n[sensor=T1]", "room#on[site=M 1]"];
        check("log.lp", bytes, &sources, &ReadOptions::default());
    }

    /// Points with every element of the protocol.
    #[must_use]
    pub fn seeds() -> Vec<Vec<u8>> {
        let text = "# a\nroom,site=M\\ 1,sensor=T1 temperature=23.7,note=\"a, b=\\\"c\\\" d\",n=1i 1422886740000000000\nroom on=t,n=2u 1422886741\n";
        vec![text.as_bytes().to_vec()]
    }
}

/// MDF 4.
pub mod mdf {
    use super::*;

    /// Reads the bytes as a file.
    pub fn run(bytes: &[u8]) {
        check("log.mf4", bytes, &["group_0#v", "v", "group_0#v[t=1]"], &ReadOptions::default());
    }

    /// A plain group of a time and a number.
    #[must_use]
    pub fn seeds() -> Vec<Vec<u8>> {
        let block = |name: &[u8], links: &[u64], content: &[u8]| {
            let length = (24 + 8 * links.len() + content.len()) as u64;
            let links: Vec<u8> = links.iter().flat_map(|link| link.to_le_bytes()).collect();
            let count = links.len() as u64 / 8;
            [b"##", name, &[0; 4], &length.to_le_bytes(), &count.to_le_bytes(), &links, content].concat()
        };
        let channel = |next: u64, name: u64, kind: u8, data: u8, byte: u32, bits: u32| {
            let content =
                [&[kind, kind / 2, data, 0][..], &byte.to_le_bytes(), &bits.to_le_bytes(), &[0; 60]].concat();
            block(b"CN", &[next, 0, name, 0, 0, 0, 0, 0], &content)
        };
        let text = |text: &str| block(b"TX", &[], text.as_bytes());
        // The positions of the blocks: the header at 64, then the group, the channels, their names, the data.
        let magic = [&b"MDF     4.11    "[..], &[0; 48]].concat();
        let head = block(b"HD", &[168, 0, 0, 0, 0, 0], &[0; 32]);
        let group = block(b"DG", &[0, 232, 720, 0], &[0; 8]);
        let channels =
            block(b"CG", &[0, 336, 0, 0, 0, 0], &[&[0; 24][..], &16_u32.to_le_bytes(), &[0; 4]].concat());
        let (time, value) = (channel(496, 656, 2, 4, 0, 64), channel(0, 688, 0, 4, 8, 64));
        let records: Vec<u8> = (0..8_u8)
            .flat_map(|step| [f64::from(step).to_le_bytes(), 1.5_f64.to_le_bytes()].concat())
            .collect();
        let (names, data) =
            ([text("t\0\0\0\0\0\0\0"), text("v\0\0\0\0\0\0\0")].concat(), block(b"DT", &[], &records));
        vec![[magic, head, group, channels, time, value, names, data].concat()]
    }
}

/// Parquet.
pub mod parquet {
    use super::*;

    /// The bytes are a file.
    pub fn run(bytes: &[u8]) {
        let sources = ["log#v", "log#ranges", "v[name=bc]@time", "log#v@row*1s!changed"];
        check("log.parquet", bytes, &sources, &ReadOptions::default());
    }

    /// A dictionary, a list, a text.
    #[must_use]
    pub fn seeds() -> Vec<Vec<u8>> {
        let times = [None, Some(1_000_000), None, Some(3_000_000)];
        vec![parquet_writer::small(), parquet_writer::moments(&[("a", &[None; 4]), ("b", &times)])]
    }
}

#[cfg(test)]
mod tests {
    use crate::TARGETS;
    use shsa_recording::{ReadOptions, Wanted, read_bytes};
    use std::path::Path;

    #[test]
    fn the_seeds_are_recordings_that_say_something() {
        #[track_caller]
        fn check(name: &str, bytes: &[u8], source: &str) {
            let wanted = [Wanted::new("/x", source)];
            let recording = read_bytes(Path::new(name), bytes, &wanted, &ReadOptions::default()).unwrap();
            assert!(!recording.samples.is_empty() && !recording.degraded, "{name}: {:?}", recording.warnings);
        }
        check("a.ulg", &super::ulog::seeds()[0], "a[0]#x");
        check("a.bin", &super::dataflash::seeds()[0][1..], "GPS#GWk");
        check("a.log", &super::dataflash::seeds()[1][1..], "IMU[1]#Roll");
        check("a.nmea", &super::nmea::seeds()[0], "RMC#speed");
        check("a.jsonl", &super::signalk::seeds()[0], "a.b[source=gps]");
        check("a.lp", &super::influx::seeds()[0], "room#n[sensor=T1]");
        check("a.mf4", &super::mdf::seeds()[0], "group_0#v");
        check("a.parquet", &super::parquet::seeds()[0], "a#v");
        assert!(TARGETS.iter().any(|target| target.name == "can"));
    }
}

//! The file itself: its JSON, and the numbers in its buffers, each checked before it is read.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use gltf::accessor::sparse::IndexType;
use gltf::accessor::{DataType, Dimensions};
use gltf::json::validation::Checked;
use gltf::{Accessor, Document, buffer, image};
use serde_json::Value;

use super::super::{SceneError, paths};
use crate::text::counted;

/// Required extensions without which a file can be read all the same, beside those of materials:
/// they are read, or what they add is left out with a word.
const READ: [&str; 4] = [
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// Extensions that put a mesh's numbers elsewhere.
const COMPRESSION: [&str; 2] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression"];

/// Most elements of an accessor that has no bytes: its count is then a number like any other.
const IMPLIED_MAX: usize = 1 << 26;

/// What to do about a file that contradicts itself.
const DAMAGED: &str = "export the file again";

/// What to do about an old file.
const TO_VERSION_2: &str = "convert it to glTF 2.0";

/// What to do about a file that needs more than is read.
const PLAIN: &str = "export it without: uncompressed, with pictures as PNG or JPEG";

/// A file whose JSON is valid, and whose buffers have as many bytes as it says.
pub(super) struct File {
    /// For messages.
    pub(super) path: PathBuf,
    /// Its JSON.
    pub(super) document: Document,
    buffers: Vec<Vec<u8>>,
    /// The file, and those of its buffers.
    pub(super) files: Vec<PathBuf>,
}

/// Bytes that something in the file refers to.
pub(super) enum Resource {
    /// They stand in the file itself.
    Inside(Vec<u8>),
    /// The path as written, decoded.
    File(String),
}

impl File {
    /// Reads a `.gltf` with its buffers, or a `.glb`.
    pub(super) fn read(path: &Path) -> Result<File, SceneError> {
        let bytes = std::fs::read(path).map_err(|error| SceneError::read(path, error))?;
        let (json, mut blob) = parts(path, &bytes)?;
        let mut root = parse(path, &json)?;
        let unread: Vec<_> = std::mem::take(&mut root.extensions_required)
            .into_iter()
            .filter(|name| !READ.contains(&name.as_str()) && !name.starts_with("KHR_materials_"))
            .collect();
        if !unread.is_empty() {
            return Err(SceneError::file(
                path,
                format!("it needs {}, which is not read here", unread.join(", ")),
                PLAIN,
            ));
        }
        let compressed = root
            .extensions_used
            .iter()
            .find(|name| COMPRESSION.contains(&name.as_str()));
        let compressed = compressed.cloned();
        complete(path, &mut root)?;
        let document = Document::from_json(root).map_err(|error| match (error, compressed) {
            (_, Some(name)) => {
                SceneError::file(path, format!("its meshes are compressed by {name}"), PLAIN)
            }
            (gltf::Error::Validation(errors), None) => {
                let places: Vec<_> = errors
                    .iter()
                    .take(3)
                    .map(|(place, error)| format!("`{place}`: {error}"))
                    .collect();
                SceneError::file(path, places.join(", "), DAMAGED)
            }
            (error, None) => SceneError::file(path, error.to_string(), DAMAGED),
        })?;
        let mut file = File {
            path: path.to_owned(),
            document,
            buffers: Vec::new(),
            files: vec![path.to_owned()],
        };
        for buffer in file.document.clone().buffers() {
            let bytes = file.buffer(&buffer, &mut blob)?;
            file.buffers.push(bytes);
        }
        Ok(file)
    }

    fn buffer(
        &mut self,
        buffer: &gltf::Buffer,
        blob: &mut Option<Vec<u8>>,
    ) -> Result<Vec<u8>, SceneError> {
        let place = format!("buffers[{}]", buffer.index());
        let bytes = match buffer.source() {
            buffer::Source::Bin => blob
                .take()
                .ok_or_else(|| self.error(&place, "has no `uri`, and there is no binary chunk"))?,
            buffer::Source::Uri(uri) => match self.resource(&place, uri)? {
                Resource::Inside(bytes) => bytes,
                Resource::File(name) => {
                    let found = paths::resolve(paths::folder_of(&self.path), &name);
                    let found = found.ok_or_else(|| {
                        SceneError::file(
                            &self.path,
                            format!("`{place}` names `{name}`, which is no file"),
                            "put it beside the .gltf",
                        )
                    })?;
                    let bytes =
                        std::fs::read(&found).map_err(|error| SceneError::read(&found, error))?;
                    self.files.push(found);
                    bytes
                }
            },
        };
        if bytes.len() < buffer.length() {
            let problem = format!("has {} of {} bytes", bytes.len(), buffer.length());
            return Err(self.error(&place, &problem));
        }
        Ok(bytes)
    }

    /// What a URI refers to.
    fn resource(&self, place: &str, uri: &str) -> Result<Resource, SceneError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
            let bytes = encoded.and_then(|encoded| STANDARD.decode(encoded.trim()).ok());
            let bytes = bytes.ok_or_else(|| self.error(place, "has data that is no base64"))?;
            return Ok(Resource::Inside(bytes));
        }
        if uri.contains("://") {
            return Err(SceneError::file(
                &self.path,
                format!("`{place}` is at {uri}"),
                "download it, and name the file: nothing is fetched here",
            ));
        }
        let name = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
        Ok(Resource::File(name.into_owned()))
    }

    /// The encoded picture of an image.
    pub(super) fn picture(&self, image: &gltf::Image) -> Result<Resource, SceneError> {
        let place = format!("images[{}]", image.index());
        match image.source() {
            image::Source::Uri { uri, .. } => self.resource(&place, uri),
            image::Source::View { view, .. } => {
                Ok(Resource::Inside(self.view(&place, &view)?.to_owned()))
            }
        }
    }

    fn view(&self, place: &str, view: &buffer::View) -> Result<&[u8], SceneError> {
        let bytes = &self.buffers[view.buffer().index()];
        let end = view.offset().checked_add(view.length());
        end.and_then(|end| bytes.get(view.offset()..end))
            .ok_or_else(|| {
                let problem = format!(
                    "wants {} from {} on, and `buffers[{}]` has {}",
                    counted(view.length(), "byte"),
                    view.offset(),
                    view.buffer().index(),
                    bytes.len()
                );
                self.error(place, &problem)
            })
    }

    /// All components of an accessor, element by element. Normalized integers are 0 to 1 or −1
    /// to 1.
    pub(super) fn numbers(&self, accessor: &Accessor) -> Result<Vec<f64>, SceneError> {
        let place = format!("accessors[{}]", accessor.index());
        let components = accessor.dimensions().multiplicity();
        let size = component_bytes(accessor.data_type());
        let decode = |bytes: &[u8]| decode(bytes, accessor.data_type(), accessor.normalized());
        let mut values = match accessor.view() {
            Some(view) => {
                let stride = view.stride().unwrap_or(size * components);
                let region = Region {
                    offset: accessor.offset(),
                    count: accessor.count(),
                    stride,
                };
                self.elements(&place, &view, &region, [size, components], decode)?
            }
            None if accessor.sparse().is_none() => {
                return Err(self.error(&place, "has no `bufferView`"));
            }
            None if accessor.count() > IMPLIED_MAX => {
                return Err(self.error(&place, "has too many elements without bytes"));
            }
            None => vec![0.0; accessor.count() * components],
        };
        if let Some(sparse) = accessor.sparse() {
            let (indices, replaced) = (sparse.indices(), sparse.values());
            let kind = match indices.index_type() {
                IndexType::U8 => DataType::U8,
                IndexType::U16 => DataType::U16,
                IndexType::U32 => DataType::U32,
            };
            let bytes = component_bytes(kind);
            let packed = |offset, stride| Region {
                offset,
                count: sparse.count(),
                stride,
            };
            let at = self.elements(
                &place,
                &indices.view(),
                &packed(indices.offset(), bytes),
                [bytes, 1],
                |bytes| decode_integer(bytes, kind),
            )?;
            let new = self.elements(
                &place,
                &replaced.view(),
                &packed(replaced.offset(), size * components),
                [size, components],
                decode,
            )?;
            for (index, new) in at.iter().zip(new.chunks(components)) {
                let first = *index as usize * components;
                let old = values.get_mut(first..first + components);
                old.ok_or_else(|| self.error(&place, "has a sparse index beyond its end"))?
                    .copy_from_slice(new);
            }
        }
        Ok(values)
    }

    /// Numbers of a part of a view; `size` is that of a component (bytes), and how many there are
    /// in an element.
    fn elements(
        &self,
        place: &str,
        view: &buffer::View,
        region: &Region,
        [size, components]: [usize; 2],
        decode: impl Fn(&[u8]) -> f64,
    ) -> Result<Vec<f64>, SceneError> {
        let bytes = self.view(place, view)?;
        let element = size * components;
        let end = (region.count.saturating_sub(1))
            .checked_mul(region.stride)
            .and_then(|end| end.checked_add(element))
            .and_then(|end| end.checked_add(region.offset));
        let fits = region.stride >= element && end.is_some_and(|end| end <= bytes.len());
        if !fits && region.count > 0 {
            let problem = format!(
                "has {} of {element} bytes, which do not fit into its buffer view of {}",
                counted(region.count, "element"),
                bytes.len()
            );
            return Err(self.error(place, &problem));
        }
        Ok((0..region.count)
            .flat_map(|index| {
                let first = region.offset + index * region.stride;
                bytes[first..first + element].chunks_exact(size)
            })
            .map(decode)
            .collect())
    }

    /// An accessor's elements as arrays of 32-bit numbers, which need not be finite.
    pub(super) fn arrays<const N: usize>(
        &self,
        accessor: &Accessor,
    ) -> Result<Vec<[f32; N]>, SceneError> {
        let components = accessor.dimensions().multiplicity();
        if components != N || accessor.dimensions() == Dimensions::Mat2 {
            let place = format!("accessors[{}]", accessor.index());
            let problem = format!("has {components} components where {N} are wanted");
            return Err(self.error(&place, &problem));
        }
        let numbers = self.numbers(accessor)?;
        let elements = numbers.chunks_exact(N);
        Ok(elements
            .map(|element| std::array::from_fn(|component| element[component] as f32))
            .collect())
    }

    /// An error at a place in the JSON.
    pub(super) fn error(&self, place: &str, problem: &str) -> SceneError {
        SceneError::file(&self.path, format!("`{place}` {problem}"), DAMAGED)
    }
}

/// Checks and fills in what the crate takes for granted: it would panic. Bounds of positions and
/// attributes of applications are not used here.
fn complete(path: &Path, root: &mut gltf::json::Root) -> Result<(), SceneError> {
    let beyond = |place: String| {
        SceneError::file(
            path,
            format!("`{place}` refers to what is not there"),
            DAMAGED,
        )
    };
    for (at, mesh) in root.meshes.iter_mut().enumerate() {
        for primitive in &mut mesh.primitives {
            primitive
                .attributes
                .retain(|name, _| matches!(name, Checked::Valid(_)));
            for index in primitive.attributes.values() {
                let accessor = root.accessors.get_mut(index.value());
                let accessor = accessor.ok_or_else(|| beyond(format!("meshes[{at}]")))?;
                let bound = || Some(serde_json::json!([0.0, 0.0, 0.0]));
                accessor.min = accessor.min.take().or_else(bound);
                accessor.max = accessor.max.take().or_else(bound);
            }
        }
    }
    for (at, animation) in root.animations.iter().enumerate() {
        let is_channel = |channel: &gltf::json::animation::Channel| {
            channel.sampler.value() < animation.samplers.len()
                && channel.target.node.value() < root.nodes.len()
                && matches!(channel.target.path, Checked::Valid(_))
        };
        let is_sampler = |sampler: &gltf::json::animation::Sampler| {
            [sampler.input, sampler.output]
                .iter()
                .all(|accessor| accessor.value() < root.accessors.len())
                && matches!(sampler.interpolation, Checked::Valid(_))
        };
        if !animation.channels.iter().all(is_channel) || !animation.samplers.iter().all(is_sampler)
        {
            return Err(beyond(format!("animations[{at}]")));
        }
    }
    for image in &mut root.images {
        let png = || Some(gltf::json::image::MimeType(String::from("image/png")));
        match image.buffer_view {
            // The bytes tell what they are.
            Some(_) => image.mime_type = image.mime_type.take().or_else(png),
            None => image.uri = image.uri.take().or_else(|| Some(String::new())),
        }
    }
    Ok(())
}

/// Elements in a buffer view, in bytes.
struct Region {
    offset: usize,
    count: usize,
    stride: usize,
}

/// The JSON, and the binary chunk of a `.glb`.
type Chunks<'a> = (Cow<'a, [u8]>, Option<Vec<u8>>);

/// Both of a file.
fn parts<'a>(path: &Path, bytes: &'a [u8]) -> Result<Chunks<'a>, SceneError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((Cow::Borrowed(bytes), None));
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .and_then(|bytes| bytes.try_into().ok())
    };
    if word(4).is_some_and(|bytes| u32::from_le_bytes(bytes) == 1) {
        return Err(SceneError::file(
            path,
            "this is binary glTF 1",
            TO_VERSION_2,
        ));
    }
    // The crate subtracts the header's length from the number that the header states.
    if word(8).is_none_or(|bytes| u32::from_le_bytes(bytes) < 12) {
        return Err(SceneError::file(path, "its header is cut short", DAMAGED));
    }
    let glb = gltf::Glb::from_slice(bytes)
        .map_err(|error| SceneError::file(path, error.to_string(), DAMAGED))?;
    Ok((glb.json, glb.bin.map(Cow::into_owned)))
}

/// The JSON, typed.
fn parse(path: &Path, json: &[u8]) -> Result<gltf::json::Root, SceneError> {
    let error = match gltf::json::deserialize::from_slice(json) {
        Ok(root) => return Ok(root),
        Err(error) => error,
    };
    let mut value: Value = serde_json::from_slice(json).unwrap_or_default();
    let version = &value["asset"]["version"];
    let version = version
        .as_str()
        .map_or_else(|| version.to_string(), str::to_owned);
    if version.starts_with('1') {
        return Err(SceneError::file(path, "this is glTF 1.0", TO_VERSION_2));
    }
    // What may be missing, and the crate's types have: the nodes of a scene, and those of channels
    // that move something else.
    for scene in list_in(&mut value, "scenes").filter_map(Value::as_object_mut) {
        scene
            .entry("nodes")
            .or_insert_with(|| Value::Array(Vec::new()));
    }
    for animation in list_in(&mut value, "animations") {
        let channels = animation.get_mut("channels").and_then(Value::as_array_mut);
        if let Some(channels) = channels {
            channels.retain(|channel| !channel["target"]["node"].is_null());
        }
    }
    gltf::json::deserialize::from_value(value)
        .map_err(|_| SceneError::file(path, format!("the JSON: {error}"), DAMAGED))
}

/// The elements of a list; none where there is no such list.
fn list_in<'v>(value: &'v mut Value, name: &str) -> impl Iterator<Item = &'v mut Value> {
    let list = value.get_mut(name).and_then(Value::as_array_mut);
    list.into_iter().flatten()
}

fn component_bytes(kind: DataType) -> usize {
    match kind {
        DataType::I8 | DataType::U8 => 1,
        DataType::I16 | DataType::U16 => 2,
        DataType::U32 | DataType::F32 => 4,
    }
}

fn decode(bytes: &[u8], kind: DataType, is_normalized: bool) -> f64 {
    if let (DataType::F32, &[a, b, c, d]) = (kind, bytes) {
        return f64::from(f32::from_le_bytes([a, b, c, d]));
    }
    let integer = decode_integer(bytes, kind);
    let scale = match kind {
        _ if !is_normalized => 1.0,
        DataType::I8 => 1.0 / 127.0,
        DataType::U8 => 1.0 / 255.0,
        DataType::I16 => 1.0 / 32_767.0,
        DataType::U16 => 1.0 / 65_535.0,
        DataType::U32 | DataType::F32 => 1.0,
    };
    (integer * scale).max(if is_normalized { -1.0 } else { f64::MIN })
}

fn decode_integer(bytes: &[u8], kind: DataType) -> f64 {
    match (kind, bytes) {
        (DataType::I8, &[a]) => f64::from(a as i8),
        (DataType::U8, &[a]) => f64::from(a),
        (DataType::I16, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
        (DataType::U16, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
        (_, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        _ => 0.0,
    }
}

// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/text_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kReadSize = std::size_t{1} << 18U;
/// No format of ours has lines near this long; a gzip bomb without line ends must not fill the
/// memory.
constexpr std::size_t kMaxLine = std::size_t{1} << 26U;

Error file_error(const std::filesystem::path& file, int system_error) {
    return Error(file.string() + ": " + std::generic_category().message(system_error));
}

/// The token without a leading plus, which from_chars does not take.
std::string_view without_plus(std::string_view token) {
    const bool has_plus = token.size() > 1 && token[0] == '+' && token[1] != '-';
    return has_plus ? token.substr(1) : token;
}

template <typename Number>
bool parse_number(std::string_view token, Number& value) {
    const std::string_view digits = without_plus(token);
    const char* const end = digits.data() + digits.size();
    Number parsed{};
    const auto [stop, error] = std::from_chars(digits.data(), end, parsed);
    if (error != std::errc{} || stop != end) {
        return false;
    }
    value = parsed;
    return true;
}

}  // namespace

struct TextFileReader::State {
    explicit State(std::filesystem::path file_in) : file(std::move(file_in)), buffer(kReadSize) {
        std::error_code ignored;
        if (std::filesystem::is_directory(file, ignored)) {
            throw file_error(file, EISDIR);
        }
        errno = 0;
        handle = gzopen(file.c_str(), "rb");
        if (handle == nullptr) {
            throw file_error(file, errno != 0 ? errno : ENOMEM);
        }
        gzbuffer(handle, kReadSize);
        std::error_code not_a_plain_file;
        const std::uintmax_t bytes = std::filesystem::file_size(file, not_a_plain_file);
        size = not_a_plain_file ? 0.0 : static_cast<double>(bytes);
    }
    ~State() { gzclose_r(handle); }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    /// Reads the next piece of the file; false when there is none.
    bool refill() {
        if (at_end) {
            return false;
        }
        const int count = gzread(handle, buffer.data(), static_cast<unsigned>(buffer.size()));
        begin = 0;
        end = count > 0 ? static_cast<std::size_t>(count) : 0;
        if (count <= 0) {
            // zlib reports a truncated file only by its error code, after it has given all that it
            // has.
            int code = Z_OK;
            gzerror(handle, &code);
            corrupt = count < 0 || (code != Z_OK && code != Z_STREAM_END);
            at_end = true;
        }
        return count > 0;
    }

    std::filesystem::path file;
    std::vector<char> buffer;
    std::size_t begin = 0;
    std::size_t end = 0;
    gzFile handle = nullptr;
    double size = 0.0;
    std::size_t line_number = 0;
    bool at_end = false;
    bool corrupt = false;
    bool unterminated = false;
};

TextFileReader::TextFileReader(const std::filesystem::path& file)
    : state_(std::make_unique<State>(file)) {}
TextFileReader::~TextFileReader() = default;
TextFileReader::TextFileReader(TextFileReader&&) noexcept = default;
TextFileReader& TextFileReader::operator=(TextFileReader&&) noexcept = default;

bool TextFileReader::next(std::string& line) {
    State& state = *state_;
    line.clear();
    bool terminated = false;
    while (!terminated && (state.begin < state.end || state.refill())) {
        const char* const start = state.buffer.data() + state.begin;
        const std::size_t available = state.end - state.begin;
        const void* const found = std::memchr(start, '\n', available);
        terminated = found != nullptr;
        const std::size_t length =
            terminated ? static_cast<std::size_t>(static_cast<const char*>(found) - start)
                       : available;
        line.append(start, length);
        state.begin += length + (terminated ? 1 : 0);
        if (line.size() > kMaxLine) {
            line.clear();
            state.begin = state.end;
            state.at_end = true;
            state.corrupt = true;
        }
    }
    if (!terminated && line.empty()) {
        return false;
    }
    state.unterminated = !terminated;
    ++state.line_number;
    if (!line.empty() && line.back() == '\r') {
        line.pop_back();
    }
    return true;
}

std::size_t TextFileReader::line_number() const {
    return state_->line_number;
}

bool TextFileReader::corrupt() const {
    return state_->corrupt;
}

bool TextFileReader::unterminated() const {
    return state_->unterminated;
}

double TextFileReader::progress() const {
    const bool consumed = state_->at_end && state_->begin == state_->end;
    if (consumed || state_->size <= 0.0) {
        return consumed ? 1.0 : 0.0;
    }
    // Plain text: exact, what was read less what still waits in our buffer. Gzip: what zlib has
    // taken from the file, which is ahead of the lines by its buffers.
    const auto waiting = static_cast<double>(state_->end - state_->begin);
    const double taken = gzdirect(state_->handle) != 0
                             ? static_cast<double>(gztell(state_->handle)) - waiting
                             : static_cast<double>(gzoffset(state_->handle));
    return std::clamp(taken / state_->size, 0.0, 1.0);
}

std::string TextFileReader::where() const {
    return state_->file.string() + ":" + std::to_string(state_->line_number);
}

std::filesystem::path replaceable_file(const std::filesystem::path& file) {
    std::error_code ignored;
    std::filesystem::path target = std::filesystem::weakly_canonical(file, ignored);
    if (ignored || target.empty()) {
        target = file;
    }
    if (std::filesystem::is_directory(target)) {
        throw file_error(file, EISDIR);
    }
    if (std::filesystem::exists(target) && !std::filesystem::is_regular_file(target)) {
        throw Error(file.string() + ": is no regular file, and is not replaced by one");
    }
    return target;
}

struct TextFileWriter::State {
    explicit State(const std::filesystem::path& file_in) : file(replaceable_file(file_in)) {
        part = file;
        part += ".part";
        // "T" makes zlib write plain text through the same calls.
        errno = 0;
        handle = gzopen(part.c_str(), file.extension() == ".gz" ? "wb" : "wbT");
        if (handle == nullptr) {
            throw file_error(file, errno != 0 ? errno : ENOMEM);
        }
        gzbuffer(handle, 128 * 1024);
    }
    ~State() {
        if (handle != nullptr) {
            gzclose_w(handle);
            discard();
        }
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    void discard() const {
        std::error_code ignored;
        std::filesystem::remove(part, ignored);
    }

    std::filesystem::path file;
    std::filesystem::path part;
    gzFile handle = nullptr;
};

TextFileWriter::TextFileWriter(const std::filesystem::path& file)
    : state_(std::make_unique<State>(file)) {}
TextFileWriter::~TextFileWriter() = default;
TextFileWriter::TextFileWriter(TextFileWriter&&) noexcept = default;
TextFileWriter& TextFileWriter::operator=(TextFileWriter&&) noexcept = default;

void TextFileWriter::write(std::string_view text) {
    if (state_->handle == nullptr) {
        throw Error(state_->file.string() + ": written to after it was closed");
    }
    constexpr std::size_t kMostAtOnce = 1U << 30U;  // zlib counts in int
    while (!text.empty()) {
        const std::string_view piece = text.substr(0, kMostAtOnce);
        errno = 0;
        if (gzwrite(state_->handle, piece.data(), static_cast<unsigned>(piece.size())) <= 0) {
            throw file_error(state_->file, errno != 0 ? errno : EIO);
        }
        text.remove_prefix(piece.size());
    }
}

void TextFileWriter::close() {
    if (state_->handle == nullptr) {
        return;
    }
    errno = 0;
    const int result = gzclose_w(state_->handle);
    const int reason = errno;
    state_->handle = nullptr;
    if (result != Z_OK) {
        state_->discard();
        throw file_error(state_->file, reason != 0 ? reason : EIO);
    }
    std::error_code error;
    std::filesystem::rename(state_->part, state_->file, error);
    if (error) {
        state_->discard();
        throw Error(state_->file.string() + ": " + error.message());
    }
}

std::string read_whole_file(const std::filesystem::path& file, std::size_t most_bytes) {
    std::error_code ignored;
    const bool is_folder = std::filesystem::is_directory(file, ignored);
    errno = 0;
    std::ifstream stream(file, std::ios::binary);
    if (is_folder || !stream) {
        throw file_error(file, is_folder ? EISDIR : errno);
    }
    std::string bytes;
    std::vector<char> piece(kReadSize);
    while (stream.read(piece.data(), static_cast<std::streamsize>(piece.size())),
           stream.gcount() > 0) {
        bytes.append(piece.data(), static_cast<std::size_t>(stream.gcount()));
        if (bytes.size() > most_bytes) {
            throw Error(file.string() + ": is larger than " + std::to_string(most_bytes) +
                        " bytes");
        }
    }
    if (stream.bad()) {
        throw file_error(file, EIO);
    }
    return bytes;
}

std::string_view Tokens::next() {
    constexpr std::string_view kBlanks = " \t";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kBlanks), rest_.size()));
    const std::string_view token = rest_.substr(0, rest_.find_first_of(kBlanks));
    rest_.remove_prefix(token.size());
    return token;
}

bool parse_double(std::string_view token, double& value) {
    return parse_number(token, value);
}

bool parse_long(std::string_view token, long& value) {
    return parse_number(token, value);
}

}  // namespace hybrid_slam

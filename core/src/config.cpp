// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/config.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <sstream>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/pose2.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

std::string double_text(double value) {
    if (std::isinf(value)) {
        return value > 0.0 ? ".inf" : "-.inf";  // as YAML spells it
    }
    return fmt::format("{}", value);  // the shortest text that reads back to the same bits
}

bool parse_yaml_double(std::string_view text, double& value) {
    if (text == ".inf" || text == "+.inf" || text == "-.inf") {
        value = text[0] == '-' ? -HUGE_VAL : HUGE_VAL;
        return true;
    }
    return parse_double(text, value);
}

/// Degrees with as few digits as give the same radians back.
double tidy_degrees(double angle) {
    for (const double unit : {1.0, 10.0, 100.0, 1e4, 1e8}) {
        const double rounded = std::round(degrees(angle) * unit) / unit;
        if (radians(rounded) == angle) {
            return rounded;
        }
    }
    return degrees(angle);
}

/// As YAML: in single quotes, which need no escapes but for themselves.
std::string quoted(const std::string& text) {
    std::string result = "'";
    for (const char letter : text) {
        result += letter == '\'' ? "''" : std::string(1, letter);
    }
    return result + "'";
}

double number_in_range(std::string_view text, double least, double most) {
    double number = 0.0;
    // Put so that NaN fails.
    if (!parse_yaml_double(text, number) || !(number >= least && number <= most)) {
        throw Error(fmt::format("must be a number from {} to {}, not '{}'", double_text(least),
                                double_text(most), text));
    }
    return number;
}

/// The parts of "[a, b]", or of "a, b" without brackets, as an override may spell it.
std::vector<std::string_view> list_items(std::string_view text) {
    const auto trimmed = [](std::string_view part) {
        const std::size_t first = part.find_first_not_of(" \t");
        const std::size_t last = part.find_last_not_of(" \t");
        return first == std::string_view::npos ? std::string_view()
                                               : part.substr(first, last - first + 1);
    };
    text = trimmed(text);
    if (text.size() >= 2 && text.front() == '[' && text.back() == ']') {
        text = trimmed(text.substr(1, text.size() - 2));
    }
    std::vector<std::string_view> items;
    while (!text.empty()) {
        const std::size_t comma = text.find(',');
        items.push_back(trimmed(text.substr(0, comma)));
        if (comma == std::string_view::npos) {
            break;
        }
        text = text.substr(comma + 1);
        if (text.empty()) {
            items.emplace_back();  // a comma with nothing behind it
        }
    }
    return items;
}

/// Levenshtein's distance: how many letters to insert, remove or replace.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
        }
    }
    return row[b.size()];
}

std::string_view last_part(std::string_view key) {
    return key.substr(key.rfind('.') + 1);  // npos + 1 is 0: the whole of a key without dots
}

/// All keys and, after them, the sections that they lie in.
std::vector<std::string_view> key_names(const std::vector<ConfigField>& fields) {
    std::vector<std::string_view> names;
    names.reserve(2 * fields.size());
    for (const ConfigField& field : fields) {
        names.emplace_back(field.key);
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::string_view outer = names[i].substr(0, names[i].rfind('.'));
        if (std::find(names.begin(), names.end(), outer) == names.end()) {
            names.push_back(outer);
        }
    }
    return names;
}

/// The known key or section that was most likely meant; empty when none is near.
std::string nearest_key(std::string_view key, const std::vector<ConfigField>& fields) {
    constexpr std::size_t kLongestGuess = 200;  // a longer one is no typing error
    std::string nearest;
    std::size_t least = std::max<std::size_t>(3, key.size() / 3) + 1;
    const auto consider = [&](std::string_view candidate, std::size_t distance) {
        if (distance < least) {
            least = distance;
            nearest = candidate;
        }
    };
    for (const std::string_view known : key_names(fields)) {
        if (key.size() <= kLongestGuess) {
            consider(known, edit_distance(key, known));
            // Somebody who forgot or mixed up the section.
            consider(known, edit_distance(last_part(key), last_part(known)) + 1);
        }
    }
    return nearest;
}

bool is_section(std::string_view key, const std::vector<ConfigField>& fields) {
    return std::any_of(fields.begin(), fields.end(), [key](const ConfigField& field) {
        return field.key.size() > key.size() && field.key[key.size()] == '.' &&
               std::string_view(field.key).substr(0, key.size()) == key;
    });
}

bool is_field(std::string_view key, const std::vector<ConfigField>& fields) {
    return std::any_of(fields.begin(), fields.end(),
                       [key](const ConfigField& field) { return field.key == key; });
}

[[noreturn]] void throw_unknown(std::string_view key, const std::vector<ConfigField>& fields) {
    const std::string nearest = nearest_key(key, fields);
    throw Error(nearest.empty()
                    ? fmt::format("key '{}': unknown key", key)
                    : fmt::format("key '{}': unknown key; did you mean '{}'?", key, nearest));
}

/// One value of a YAML file, its key joined with dots.
struct Entry {
    std::string key;
    std::string value;
    int line = 0;
};

/// Walks the maps of one file and refuses what cannot be a value. Descends only where the schema
/// has a section, so that neither an alias to its own map nor a bomb of aliases keeps it busy.
class Flattener {
  public:
    Flattener(std::string file, const std::vector<ConfigField>& fields)
        : file_(std::move(file)), fields_(fields) {}

    void walk(const YAML::Node& map, const std::string& prefix) {
        for (const auto& item : map) {
            line_ = item.first.Mark().line + 1;
            if (!item.first.IsScalar()) {
                fail("a key must be a plain word");
            }
            const std::string key = prefix + item.first.Scalar();
            if (const auto [first, is_new] = lines_.emplace(key, line_); !is_new) {
                fail(fmt::format("key '{}': repeated, it is in line {} already", key,
                                 first->second));
            }
            visit(key, item.second);
        }
    }

    const std::vector<Entry>& entries() const { return entries_; }

  private:
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(fmt::format("{}:{}: {}", file_, line_, what));
    }

    void visit(const std::string& key, const YAML::Node& value) {
        if (is_section(key, fields_)) {
            if (value.IsMap()) {
                walk(value, key + ".");
            } else if (!value.IsNull()) {  // a section may have all of its keys commented out
                fail(fmt::format("key '{}': is a section and takes no value", key));
            }
            return;
        }
        const auto field = std::find_if(fields_.begin(), fields_.end(),
                                        [&key](const ConfigField& f) { return f.key == key; });
        const bool is_list = field != fields_.end() && field->is_list;
        if (field != fields_.end() && (is_list ? !value.IsSequence() : !value.IsScalar())) {
            fail(fmt::format("key '{}': needs {}", key,
                             is_list ? "a list like [1, 2]" : "a single value"));
        }
        entries_.push_back({key, is_list ? list_text(value) : scalar_text(value), line_});
    }

    static std::string scalar_text(const YAML::Node& value) {
        return value.IsScalar() ? value.Scalar() : "";
    }

    /// What list_items takes apart again; an item that is no scalar becomes an empty one.
    static std::string list_text(const YAML::Node& list) {
        std::string text;
        for (const YAML::Node& item : list) {
            text += (text.empty() ? "[" : ", ") + (item.IsScalar() ? item.Scalar() : "?");
        }
        return text.empty() ? "[]" : text + "]";
    }

    std::string file_;
    const std::vector<ConfigField>& fields_;
    std::vector<Entry> entries_;
    std::map<std::string, int> lines_;
    int line_ = 0;
};

std::vector<Entry> read_entries(const std::filesystem::path& file,
                                const std::vector<ConfigField>& fields) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
    const std::string text = read_whole_file(file, kMostBytes);
    try {
        const std::vector<YAML::Node> documents = YAML::LoadAll(text);
        if (documents.empty() || documents[0].IsNull()) {
            return {};
        }
        if (documents.size() > 1) {
            throw Error(file.string() + ": holds more than one YAML document");
        }
        if (!documents[0].IsMap()) {
            throw Error(file.string() + ":1: must hold lines like 'key: value'");
        }
        Flattener flattener(file.string(), fields);
        flattener.walk(documents[0], "");
        return flattener.entries();
    } catch (const YAML::Exception& error) {
        throw Error(fmt::format("{}:{}: {}", file.string(), error.mark.line + 1, error.msg));
    }
}

/// Writes fields[begin..] whose keys start with `prefix`, sections as nested maps. Fields of a
/// section that were declared apart come together at the first of them: a YAML map has each key
/// only once.
void write_section(const std::vector<const ConfigField*>& fields, std::size_t depth,
                   const std::string& prefix, std::ostream& out) {
    const std::string indent(2 * depth, ' ');
    std::vector<std::string> written;
    for (const ConfigField* field : fields) {
        const std::string rest = field->key.substr(prefix.size());
        const std::string name = rest.substr(0, rest.find('.'));
        if (name == rest) {
            const std::string value = field->is_text ? quoted(field->get()) : field->get();
            out << indent << name << ": " << value << "  # " << field->help << '\n';
            continue;
        }
        if (std::find(written.begin(), written.end(), name) != written.end()) {
            continue;
        }
        written.push_back(name);
        const std::string inner_prefix = prefix + name + ".";
        std::vector<const ConfigField*> inner;
        std::copy_if(fields.begin(), fields.end(), std::back_inserter(inner),
                     [&inner_prefix](const ConfigField* other) {
                         return other->key.compare(0, inner_prefix.size(), inner_prefix) == 0;
                     });
        out << indent << name << ":\n";
        write_section(inner, depth + 1, inner_prefix, out);
    }
}

}  // namespace

ConfigSchema::Section::Section(ConfigSchema& schema, std::string_view name)
    : schema_(schema), outer_prefix_(schema.prefix_) {
    schema_.prefix_ += std::string(name) + ".";
}

ConfigSchema::Section::~Section() {
    schema_.prefix_ = outer_prefix_;
}

void ConfigSchema::add(std::string_view key, bool& value, std::string_view help) {
    add_field(
        key, help,
        [&value](std::string_view text) {
            if (text != "true" && text != "false") {
                throw Error(fmt::format("must be true or false, not '{}'", text));
            }
            value = text == "true";
        },
        [&value] { return std::string(value ? "true" : "false"); });
}

void ConfigSchema::add(std::string_view key, int& value, int least, int most,
                       std::string_view help) {
    add_field(
        key, help,
        [&value, least, most](std::string_view text) {
            long number = 0;
            if (!parse_long(text, number) || number < least || number > most) {
                throw Error(fmt::format("must be a whole number from {} to {}, not '{}'", least,
                                        most, text));
            }
            value = static_cast<int>(number);
        },
        [&value] { return std::to_string(value); });
}

void ConfigSchema::add(std::string_view key, double& value, double least, double most,
                       std::string_view help) {
    add_field(
        key, help,
        [&value, least, most](std::string_view text) {
            value = number_in_range(text, least, most);
        },
        [&value] { return double_text(value); });
}

void ConfigSchema::add(std::string_view key, std::string& value, std::string_view help) {
    add_field(
        key, help,
        [&value](std::string_view text) {
            if (text.find_first_of("\r\n") != std::string_view::npos) {
                throw Error("must be one line");
            }
            value = text;
        },
        [&value] { return value; });
    fields_.back().is_text = true;
}

void ConfigSchema::add(std::string_view key, std::vector<double>& values, double least, double most,
                       std::string_view help) {
    add_field(
        key, help,
        [&values, least, most](std::string_view text) {
            std::vector<double> numbers;
            for (const std::string_view item : list_items(text)) {
                numbers.push_back(number_in_range(item, least, most));
            }
            values = std::move(numbers);
        },
        [&values] {
            std::string text = "[";
            for (const double number : values) {
                text += (text.size() > 1 ? ", " : "") + double_text(number);
            }
            return text + "]";
        });
    fields_.back().is_list = true;
}

void ConfigSchema::add_degrees(std::string_view key, double& angle, double least_deg,
                               double most_deg, std::string_view help) {
    add_field(
        key, help,
        [&angle, least_deg, most_deg](std::string_view text) {
            angle = radians(number_in_range(text, least_deg, most_deg));
        },
        [&angle] { return double_text(tidy_degrees(angle)); });
}

void ConfigSchema::add_enum(std::string_view key,
                            const std::vector<std::pair<std::string, int>>& names,
                            const std::function<void(int)>& set, const std::function<int()>& get,
                            std::string_view help) {
    const auto set_name = [names, set](std::string_view text) {
        std::string accepted;
        for (const auto& [name, number] : names) {
            if (name == text) {
                set(number);
                return;
            }
            accepted += (accepted.empty() ? "" : ", ") + name;
        }
        throw Error(fmt::format("must be one of {}, not '{}'", accepted, text));
    };
    const auto get_name = [names, get] {
        const int wanted = get();
        for (const auto& [name, number] : names) {
            if (number == wanted) {
                return name;
            }
        }
        return std::to_string(wanted);
    };
    add_field(key, help, set_name, get_name);
}

void ConfigSchema::add_field(std::string_view key, std::string_view help,
                             std::function<void(std::string_view)> set,
                             std::function<std::string()> get) {
    ConfigField field{prefix_ + std::string(key),
                      std::string(help),
                      std::move(set),
                      std::move(get),
                      false,
                      false};
    bool clashes = is_field(field.key, fields_) || is_section(field.key, fields_);
    for (std::size_t dot = field.key.find('.'); dot != std::string::npos;
         dot = field.key.find('.', dot + 1)) {
        clashes = clashes || is_field(field.key.substr(0, dot), fields_);
    }
    if (clashes) {
        throw Error(fmt::format("key '{}': declared twice", field.key));
    }
    // A struct that was filled by code is held to the same ranges as a file.
    try {
        field.set(field.get());
    } catch (const Error& error) {
        throw Error(fmt::format("key '{}': {}", field.key, error.what()));
    }
    fields_.push_back(std::move(field));
}

void ConfigSchema::set(std::string_view key, std::string_view value) {
    const auto field =
        std::find_if(fields_.begin(), fields_.end(),
                     [key](const ConfigField& candidate) { return candidate.key == key; });
    if (field == fields_.end()) {
        throw_unknown(key, fields_);
    }
    try {
        field->set(value);
    } catch (const Error& error) {
        throw Error(fmt::format("key '{}': {}", key, error.what()));
    }
}

void ConfigSchema::load(const std::filesystem::path& file) {
    for (const Entry& entry : read_entries(file, fields_)) {
        try {
            set(entry.key, entry.value);
        } catch (const Error& error) {
            throw Error(fmt::format("{}:{}: {}", file.string(), entry.line, error.what()));
        }
    }
}

void ConfigSchema::override_with(std::string_view assignment) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string_view::npos || equals == 0) {
        throw Error(fmt::format("'{}': must look like key=value", assignment));
    }
    set(assignment.substr(0, equals), assignment.substr(equals + 1));
}

std::string ConfigSchema::to_yaml() const {
    std::vector<const ConfigField*> all;
    all.reserve(fields_.size());
    for (const ConfigField& field : fields_) {
        all.push_back(&field);
    }
    std::ostringstream out;
    write_section(all, 0, "", out);
    return out.str();
}

}  // namespace hybrid_slam

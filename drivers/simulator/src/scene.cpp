// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include <algorithm>
#include <cmath>

#include "hash.hpp"
#include "materials.hpp"

namespace hybrid_slam {
namespace {

constexpr double kWallCell = 0.6;  ///< metres, about: a wall has whole ones
constexpr int kMostWallBits = 8;   ///< a wall repeats after 2^8 cells

enum class WallKind { kPlain, kBrick, kBlock, kPanel, kDoor, kStorage };

Picture pick(const Pictures& pictures, std::uint64_t hashed) {
    return pictures[hashed % pictures.size()];
}

int bits_for(int count) {
    int bits = 0;
    while ((1 << bits) < count) {
        ++bits;
    }
    return bits;
}

/// Of one square of a picture.
FigureCover cover_of(const TextureAtlas& atlas, Picture picture, int column, int row) {
    const int side = atlas.side() / Figure::kSquares;
    const Texel* texels =
        atlas.level(0) + (static_cast<std::size_t>(picture) << (2 * atlas.side_bits()));
    int opaque = 0;
    for (int i = 0; i < side * side; ++i) {
        const int at = (row * side + i / side) * atlas.side() + column * side + i % side;
        opaque += texels[at] == kTransparent ? 0 : 1;
    }
    if (opaque == 0) {
        return FigureCover::kNothing;
    }
    return opaque == side * side ? FigureCover::kAll : FigureCover::kPart;
}

/// Lays the pictures of all surfaces into a scene.
class Decorator {
  public:
    Decorator(Scene& scene, const RenderConfig& config, std::uint64_t seed)
        : scene_(scene),
          config_(config),
          seed_(seed),
          materials_(paint_materials(scene.atlas, config, hash(seed, 1))) {}

    void lay_floor();
    void lay_roof();
    void add_walls(const std::vector<Segment>& walls);
    void add_post(const Circle& post);
    void add_people();

  private:
    CellGrid make_grid(int u_bits, int v_bits);
    std::vector<float> zones() const;
    Picture floor_picture(int u, int v, float zone, float bare_low, float bare_high);
    bool on_line(int across, int along, std::uint64_t salt) const;
    WallKind kind_of(const Segment& wall, std::uint64_t number) const;
    WallKind random_kind(std::uint64_t number) const;
    Picture wall_picture(WallKind kind, int u, int v, std::uint64_t hashed) const;
    CellGrid decorate(WallKind kind, int columns, std::uint64_t number);
    WallSurface surface_of(const Segment& wall) const;
    void add_wall(const Segment& wall, WallKind kind, std::uint64_t number);

    Scene& scene_;
    const RenderConfig& config_;
    std::uint64_t seed_;
    Materials materials_;
};

CellGrid Decorator::make_grid(int u_bits, int v_bits) {
    const auto first = static_cast<std::uint32_t>(scene_.cells.size());
    scene_.cells.resize(scene_.cells.size() + (std::size_t{1} << (u_bits + v_bits)));
    return {first, u_bits, v_bits};
}

/// Whether a painted line runs along row `across` of the cells at `along`.
bool Decorator::on_line(int across, int along, std::uint64_t salt) const {
    constexpr int kLanes = 16;  // cells between two lanes
    constexpr int kPiece = 16;  // cells in one piece of a line
    const auto lane = static_cast<std::uint64_t>(across / kLanes);
    const std::uint64_t hashed = hash(seed_, salt, lane);
    const bool painted = unit_of(hash(hashed, static_cast<std::uint64_t>(along / kPiece))) < 0.6;
    return painted && across % kLanes == static_cast<int>(hashed % kLanes);
}

Picture Decorator::floor_picture(int u, int v, float zone, float bare_low, float bare_high) {
    const FloorMaterials& floor = materials_.floor;
    const std::uint64_t hashed =
        hash(seed_, static_cast<std::uint64_t>(u), static_cast<std::uint64_t>(v));
    if (zone < bare_low) {
        return pick(floor.gloss, hashed);
    }
    if (on_line(v, u, 11)) {
        return pick(floor.lines_x, hashed);
    }
    if (on_line(u, v, 12)) {
        return pick(floor.lines_y, hashed);
    }
    if (zone >= bare_high) {
        const int cell = (v % kConcreteCells) * kConcreteCells + u % kConcreteCells;
        return floor.concrete[static_cast<std::size_t>(cell)];
    }
    return pick(hashed % 40 == 0 ? floor.marks : floor.tiles, hash(hashed));
}

/// The lowest values of a smooth pattern become gloss, the highest concrete, tiles lie between.
void Decorator::lay_floor() {
    const int side = 1 << kFloorBits;
    scene_.floor = make_grid(kFloorBits, kFloorBits);
    scene_.floor_shine.resize(std::size_t{1} << (2 * kFloorBits));
    const Pattern zones(side, side / 8, 2, 0.8F, hash(seed_, 3));
    std::vector<float> sorted;
    sorted.reserve(scene_.floor_shine.size());
    for (int cell = 0; cell < side * side; ++cell) {
        sorted.push_back(zones.at(cell % side, cell / side));
    }
    std::sort(sorted.begin(), sorted.end());
    const auto quantile = [&sorted](double share) {
        const auto last = static_cast<double>(sorted.size() - 1);
        return sorted[static_cast<std::size_t>(share * last)];
    };
    const bool bare = config_.bare_floor > 0.0;
    const float low = bare ? quantile(0.4 * config_.bare_floor) : sorted.front() - 1.0F;
    const float high = bare ? quantile(1.0 - 0.6 * config_.bare_floor) : sorted.back() + 1.0F;
    for (int cell = 0; cell < side * side; ++cell) {
        const int u = cell % side;
        const int v = cell / side;
        const float zone = zones.at(u, v);
        const std::uint32_t at = scene_.floor.index(u, v);
        scene_.cells[at] = floor_picture(u, v, zone, low, high);
        const double polish = zone < low ? 1.0 : (zone >= high ? 0.25 : 0.4);
        scene_.floor_shine[static_cast<std::size_t>(cell)] =
            static_cast<float>(config_.shine * polish);
    }
}

void Decorator::lay_roof() {
    constexpr int kBits = 5;
    static_assert(kRoofCell * (1 << kBits) == Lamps::kSpacing * Lamps::kEachWay);
    scene_.roof = make_grid(kBits, kBits);
    for (int v = 0; v < 1 << kBits; ++v) {
        for (int u = 0; u < 1 << kBits; ++u) {
            const bool lamp = u % 4 == 1 && v % 4 == 1 && scene_.lamps.is_lit(u / 4, v / 4);
            const bool beam = v % 4 == 3;
            scene_.cells[scene_.roof.index(u, v)] = materials_.roof[lamp ? 2U : (beam ? 1U : 0U)];
        }
    }
    scene_.haze = make_grid(0, 0);
    scene_.cells[scene_.haze.first] = materials_.haze;
}

WallKind Decorator::kind_of(const Segment& wall, std::uint64_t number) const {
    const double length = (wall.end - wall.start).norm();
    if (length > 0.8 && length < 1.35) {
        return WallKind::kDoor;
    }
    return random_kind(number);
}

WallKind Decorator::random_kind(std::uint64_t number) const {
    const std::uint64_t hashed = hash(seed_, 21, number);
    if (unit_of(hashed) < config_.plain_walls) {
        return WallKind::kPlain;
    }
    constexpr WallKind kKinds[] = {WallKind::kBrick, WallKind::kBlock, WallKind::kPanel};
    return kKinds[hash(hashed) % 3];
}

Picture Decorator::wall_picture(WallKind kind, int u, int v, std::uint64_t hashed) const {
    const WallMaterials& walls = materials_.walls;
    const bool at_eye_level = v == 1 || v == 2;
    switch (kind) {
        case WallKind::kBrick:
            return pick(at_eye_level && hashed % 9 == 0 ? walls.posters : walls.brick,
                        hash(hashed));
        case WallKind::kBlock:
            return pick(walls.block, hashed);
        case WallKind::kPanel:
            return pick(at_eye_level && hashed % 16 == 0 ? walls.signs : walls.panel, hash(hashed));
        case WallKind::kDoor: {
            const int row = std::min(v, kDoorRows - 1);
            const int cell = (u % 2) * kDoorRows + row;
            return v < kDoorRows ? walls.door[static_cast<std::size_t>(cell)] : walls.plain.front();
        }
        case WallKind::kStorage:
            if (v % 2 == 0) {
                return pick(v == 0 ? walls.pallets : walls.beams, hashed);
            }
            return pick(walls.cartons, hashed);
        case WallKind::kPlain:
            break;
    }
    if (v == 0) {
        return walls.skirting.front();
    }
    return pick(at_eye_level && hashed % 30 == 0 ? walls.signs : walls.plain, hash(hashed));
}

CellGrid Decorator::decorate(WallKind kind, int columns, std::uint64_t number) {
    constexpr int kPiece = 12;  // cells after which a long wall may change
    const int rows = std::max(static_cast<int>(std::round(config_.wall_height / kWallCell)), 1);
    const CellGrid grid = make_grid(bits_for(columns), bits_for(rows + 1));
    for (int v = 0; v < 1 << grid.v_bits; ++v) {
        for (int u = 0; u < 1 << grid.u_bits; ++u) {
            const auto piece = static_cast<std::uint64_t>(u / kPiece);
            const bool same = piece == 0 || kind == WallKind::kStorage;
            const int cell = (v << kMostWallBits) + u;
            const std::uint64_t hashed = hash(seed_, number, static_cast<std::uint64_t>(cell));
            scene_.cells[grid.index(u, v)] = wall_picture(
                same ? kind : random_kind(hash(number, piece)), u, std::min(v, rows - 1), hashed);
        }
    }
    return grid;
}

/// Empty of cells; those that decorate() made are to be set.
WallSurface Decorator::surface_of(const Segment& wall) const {
    WallSurface surface;
    surface.segment = wall;
    surface.length = (wall.end - wall.start).norm();
    surface.along = (wall.end - wall.start) / surface.length;
    surface.u_cells = std::max(std::round(surface.length / kWallCell), 1.0);
    surface.v_cells = std::max(std::round(config_.wall_height / kWallCell), 1.0);
    // As if a little sun came in from one side: plain walls that meet in a corner differ.
    const double towards_sun = surface.along.dot(Eigen::Vector2d(0.8, 0.6));
    surface.shade = static_cast<float>(0.86 + 0.14 * std::abs(towards_sun));
    return surface;
}

void Decorator::add_wall(const Segment& wall, WallKind kind, std::uint64_t number) {
    if (wall.start == wall.end) {
        return;
    }
    WallSurface surface = surface_of(wall);
    const double columns = std::min(surface.u_cells, static_cast<double>(1 << kMostWallBits));
    surface.cells = decorate(kind, static_cast<int>(columns), number);
    scene_.walls.push_back(surface);
}

/// A small closed outline is a thing that stands there: a pallet, a rack.
std::size_t end_of_thing(const std::vector<Segment>& walls, std::size_t first) {
    constexpr std::size_t kMostSides = 12;
    constexpr double kLargest = 6.0;  // metres
    for (std::size_t i = first; i < walls.size() && i < first + kMostSides; ++i) {
        if ((walls[i].end - walls[first].start).norm() > kLargest) {
            break;
        }
        if (walls[i].end == walls[first].start) {
            return i + 1;
        }
        if (i + 1 < walls.size() && walls[i + 1].start != walls[i].end) {
            break;
        }
    }
    return first;
}

void Decorator::add_walls(const std::vector<Segment>& walls) {
    std::size_t end = 0;
    for (std::size_t i = 0; i < walls.size(); ++i) {
        end = i < end ? end : end_of_thing(walls, i);
        const WallKind kind = i < end ? WallKind::kStorage : kind_of(walls[i], i);
        add_wall(walls[i], kind, i);
    }
}

/// As flats that lie a millimetre within the circle in their middle and as much outside at their
/// ends.
void Decorator::add_post(const Circle& post) {
    constexpr double kSagitta = 0.002;  // metres
    const double share = std::max(1.0 - kSagitta / post.radius, 0.5);
    const int flats = std::max(static_cast<int>(std::ceil(kPi / std::acos(share))), 8);
    const double half = kPi / flats;
    const double radius = 2.0 * post.radius / (1.0 + std::cos(half));
    const auto corner = [&](int i) -> Point2 {
        const double angle = 2.0 * half * i;
        return post.center + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    };
    const double cells = std::max(std::round(2.0 * kPi * post.radius / kWallCell), 1.0);
    const auto number = (std::uint64_t{1} << 40U) + scene_.walls.size();
    const bool metal = hash(seed_, number) % 2 == 0;
    const CellGrid grid = decorate(metal ? WallKind::kPanel : WallKind::kBlock,
                                   static_cast<int>(std::min(cells, 256.0)), number);
    for (int i = 0; i < flats; ++i) {
        WallSurface surface = surface_of({corner(i), corner((i + 1) % flats)});
        surface.cells = grid;
        surface.u_cells = cells / flats;
        surface.u_start = surface.u_cells * i;
        scene_.walls.push_back(surface);
    }
}

void Decorator::add_people() {
    for (const Pictures& rows : materials_.people) {
        Figure figure;
        figure.cells = make_grid(0, bits_for(kPersonRows));
        figure.square_bits = scene_.atlas.side_bits() - bits_for(Figure::kSquares);
        for (int v = 0; v < 1 << figure.cells.v_bits; ++v) {
            const auto row = static_cast<std::size_t>(std::min(v, kPersonRows - 1));
            scene_.cells[figure.cells.index(0, v)] = rows[row];
        }
        for (const Picture row : rows) {
            for (int square = 0; square < Figure::kSquares * Figure::kSquares; ++square) {
                figure.squares.push_back(cover_of(scene_.atlas, row, square % Figure::kSquares,
                                                  square / Figure::kSquares));
            }
        }
        scene_.figures.push_back(figure);
    }
}

}  // namespace

FigureCover Figure::cover(const Eigen::Array2f& least, const Eigen::Array2f& most) const {
    const int side = 1 << square_bits;
    const int rows = static_cast<int>(squares.size()) / kSquares;
    // Those beyond the board's rim count as the first ones there.
    const auto square = [side](float texel, int count) {
        const float bounded = std::clamp(texel, -1.0F, static_cast<float>(count * side));
        return bounded < 0.0F ? -1 : static_cast<int>(bounded) / side;
    };
    bool all = true;
    bool nothing = true;
    for (int row = square(least.y(), rows); row <= square(most.y(), rows); ++row) {
        for (int column = square(least.x(), kSquares); column <= square(most.x(), kSquares);
             ++column) {
            const bool on_board = row >= 0 && row < rows && column >= 0 && column < kSquares;
            const int at = row * kSquares + column;
            const FigureCover here =
                on_board ? squares[static_cast<std::size_t>(at)] : FigureCover::kNothing;
            all = all && here == FigureCover::kAll;
            nothing = nothing && here == FigureCover::kNothing;
        }
    }
    return all ? FigureCover::kAll : (nothing ? FigureCover::kNothing : FigureCover::kPart);
}

Scene::Scene(const World& world, const RenderConfig& config, int side_bits, std::uint64_t seed)
    : atlas(side_bits, kMostPictures), lamps(config.ceiling_height, hash(seed, 2)) {
    Decorator decorator(*this, config, seed);
    decorator.lay_floor();
    decorator.lay_roof();
    decorator.add_walls(world.walls);
    for (const Circle& post : world.posts) {
        decorator.add_post(post);
    }
    decorator.add_people();
}

}  // namespace hybrid_slam

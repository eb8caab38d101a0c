// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"

namespace hybrid_slam::tools {

struct Color {
    std::uint8_t red = 0;
    std::uint8_t green = 0;
    std::uint8_t blue = 0;
};

/// Halfway colours: ratio 0 gives `from`, 1 gives `to`.
Color mix(const Color& from, const Color& to, double ratio);

/// Pixels to the right and down from the upper left corner of the picture.
using Pixel = Eigen::Vector2d;

struct Rect {
    int x = 0;
    int y = 0;
    int width = 0;
    int height = 0;
};

struct Stroke {
    Color color;
    int width = 1;  ///< pixels
};

enum class Align { kLeft, kCenter, kRight };

struct TextStyle {
    int height = 16;  ///< pixels, of a capital letter
    Color color{45, 50, 58};
    Align align = Align::kLeft;
    bool bold = false;
};

/// How the three states of a grid look.
struct GridShades {
    Color free{255, 255, 255};
    Color unknown{232, 234, 237};
    Color wall{40, 45, 55};
};

/// A picture to draw on, anti-aliased. Letters are plain ASCII.
class Canvas {
  public:
    Canvas(int width, int height);  ///< white
    ~Canvas();
    Canvas(Canvas&&) noexcept;
    Canvas& operator=(Canvas&&) noexcept;

    int width() const;
    int height() const;

    /// Nothing is drawn outside of it until the next call.
    void clip_to(const Rect& rect);
    void clip_to_all();

    void fill(const Rect& rect, const Color& color);
    void outline(const Rect& rect, const Color& color);
    void line(const Pixel& from, const Pixel& to, const Stroke& stroke);
    void polyline(const std::vector<Pixel>& pixels, const Stroke& stroke);
    void disc(const Pixel& center, double radius, const Color& color);
    /// Darkens single pixels; those that are hit often become as dark as `color`.
    void speckle(const std::vector<Pixel>& pixels, const Color& color);
    /// At its left, middle or right end on the baseline.
    void text(const Pixel& baseline, const std::string& letters, const TextStyle& style);
    /// The upper left corner of the grid's top row lies at `corner`.
    void grid(const StateGrid& grid, const Pixel& corner, double pixels_per_cell,
              const GridShades& shades);

    /// As large as fits into the rectangle, in its middle.
    void image(const Image& image, const Rect& rect);

    /// Throws Error when the file cannot be written.
    void write_png(const std::filesystem::path& file) const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Pixels that the letters take in width.
double text_width(const std::string& letters, const TextStyle& style);

}  // namespace hybrid_slam::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/core/camera_model.hpp"
#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

/// A printed chessboard, told by its inner corners: those at which four squares meet.
struct Chessboard {
    int columns = 9;
    int rows = 6;
    double square = 0.025;  ///< metres, side of a square
};

/// Throws Error for fewer than 3 or more than 100 columns or rows, and for squares without a size.
void check(const Chessboard& board);

/// A board as it was seen.
struct BoardSight {
    std::vector<Pixel> corners;  ///< row by row; a board turned by half a turn looks the same
    /// Pixels over which black turns into white, of the more blurred of the two directions of
    /// edges; 2 to 4 in a sharp photo. 0: the squares are too small (10 pixels) to measure it.
    double edge_width = 0.0;
};

/// Empty when not all corners of the board are to be seen.
std::optional<BoardSight> find_board(const Image& image, const Chessboard& board);

/// One photo that was to show the board.
struct BoardPhoto {
    std::string name;
    std::vector<Pixel> corners;
    double edge_width = 0.0;  ///< pixels, see BoardSight
    std::string refusal;      ///< why it is not used; empty when it is

    bool usable() const { return refusal.empty(); }
};

/// The photos of one board by one camera: those that are of use, and why others are not.
class BoardPhotos {
  public:
    /// Edges wider than this for each 640 pixels of the longer side (never less) are blurred.
    static constexpr double kMostEdgeWidth = 5.0;

    /// Throws Error for a board that cannot be.
    explicit BoardPhotos(const Chessboard& board, double most_edge_width = kMostEdgeWidth);

    /// Looks for the board. Refuses a photo without one, a blurred one, and one of another size
    /// than the first usable one.
    const BoardPhoto& add(std::string name, const Image& image);
    /// Notes one that could not even be read.
    const BoardPhoto& refuse(std::string name, std::string reason);

    const Chessboard& board() const { return board_; }
    const std::vector<BoardPhoto>& photos() const { return photos_; }
    std::size_t usable() const;
    int width() const { return width_; }    ///< pixels; 0 until one is usable
    int height() const { return height_; }  ///< pixels

  private:
    std::string refusal_of(const Image& image, const std::optional<BoardSight>& sight) const;

    Chessboard board_;
    double most_edge_width_;
    std::vector<BoardPhoto> photos_;
    int width_ = 0;
    int height_ = 0;
};

}  // namespace hybrid_slam

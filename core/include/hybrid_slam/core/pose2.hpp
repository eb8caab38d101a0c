// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <ostream>
#include <utility>

namespace hybrid_slam {

inline constexpr double kPi = 3.14159265358979323846;

/// Wraps an angle in radians into [-pi, pi). The one place where angles are wrapped; works on Jets.
template <typename Scalar>
Scalar normalize_angle(const Scalar& angle) {
    using std::floor;
    const Scalar turn(2.0 * kPi);
    const Scalar wrapped = angle - turn * floor((angle + Scalar(kPi)) / turn);
    // Rounding can leave the quotient on the wrong side of a whole number.
    if (wrapped < Scalar(-kPi)) {
        return wrapped + turn;
    }
    return wrapped < Scalar(kPi) ? wrapped : Scalar(wrapped - turn);
}

constexpr double radians(double degrees) {
    return degrees * kPi / 180.0;
}
constexpr double degrees(double radians) {
    return radians * 180.0 / kPi;
}

/// An element of SE(2), named by its frames: `a_from_b` takes the coordinates of a point in frame b
/// to those in frame a, so that a_from_c = a_from_b * b_from_c. Metres and radians.
/// The scalar may be a ceres::Jet.
template <typename Scalar>
struct Pose2 {
    using Vector2 = Eigen::Matrix<Scalar, 2, 1>;
    using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
    using Matrix2 = Eigen::Matrix<Scalar, 2, 2>;

    Vector2 translation = Vector2::Zero();
    Scalar heading = Scalar(0);  ///< counter-clockwise from the x axis; products are wrapped

    Pose2() = default;
    Pose2(Scalar x, Scalar y, Scalar heading_in) : translation(x, y), heading(heading_in) {}
    Pose2(Vector2 translation_in, Scalar heading_in)
        : translation(std::move(translation_in)), heading(heading_in) {}

    Scalar x() const { return translation.x(); }
    Scalar y() const { return translation.y(); }
    Vector3 vector() const { return {translation.x(), translation.y(), heading}; }

    Matrix2 rotation() const {
        using std::cos;
        using std::sin;
        const Scalar c = cos(heading);
        const Scalar s = sin(heading);
        Matrix2 matrix;
        matrix << c, -s, s, c;
        return matrix;
    }

    Pose2 inverse() const {
        return {-(rotation().transpose() * translation), normalize_angle(Scalar(-heading))};
    }

    Pose2 operator*(const Pose2& other) const {
        return {translation + rotation() * other.translation,
                normalize_angle(Scalar(heading + other.heading))};
    }

    Vector2 operator*(const Vector2& point) const { return translation + rotation() * point; }

    /// Group exponential of a twist (vx, vy, omega) over unit time: a motion along an arc.
    static Pose2 exp(const Vector3& twist) {
        const auto [a, b] = arc_coefficients(twist.z());
        return {a * twist.x() - b * twist.y(), b * twist.x() + a * twist.y(),
                normalize_angle(Scalar(twist.z()))};
    }

    /// Inverse of exp; the rotation part lies in [-pi, pi).
    Vector3 log() const {
        const Scalar angle = normalize_angle(heading);
        const auto [a, b] = arc_coefficients(angle);
        const Scalar norm = a * a + b * b;
        return {(a * x() + b * y()) / norm, (a * y() - b * x()) / norm, angle};
    }

    /// Adjoint: a twist given in b, seen from a, for a_from_b. Twists ordered (x, y, heading).
    Eigen::Matrix<Scalar, 3, 3> adjoint() const {
        Eigen::Matrix<Scalar, 3, 3> matrix = Eigen::Matrix<Scalar, 3, 3>::Identity();
        matrix.template topLeftCorner<2, 2>() = rotation();
        matrix(0, 2) = y();
        matrix(1, 2) = -x();
        return matrix;
    }

    template <typename Other>
    Pose2<Other> cast() const {
        return {translation.template cast<Other>(), Other(heading)};
    }

  private:
    struct Arc {
        Scalar a;  ///< sin(w) / w
        Scalar b;  ///< (1 - cos(w)) / w
    };
    static Arc arc_coefficients(const Scalar& w) {
        using std::abs;
        using std::sin;
        const Scalar one(1);
        if (abs(w) < Scalar(1e-2)) {
            // Series, because the quotients and more so their derivatives cancel digits here.
            const Scalar w2 = w * w;
            return {
                one - w2 / Scalar(6) * (one - w2 / Scalar(20) * (one - w2 / Scalar(42))),
                w / Scalar(2) *
                    (one - w2 / Scalar(12) * (one - w2 / Scalar(30) * (one - w2 / Scalar(56))))};
        }
        const Scalar half_sine = sin(w / Scalar(2));
        return {sin(w) / w, Scalar(2) * half_sine * half_sine / w};
    }
};

using Pose2d = Pose2<double>;

/// Inverse of the left factor times the right: the pose of `to` seen from `from`.
template <typename Scalar>
Pose2<Scalar> between(const Pose2<Scalar>& from, const Pose2<Scalar>& to) {
    return {from.rotation().transpose() * (to.translation - from.translation),
            normalize_angle(Scalar(to.heading - from.heading))};
}

/// Geodesic-like blend used for stamps between two poses: ratio 0 gives `from`, 1 gives `to`.
inline Pose2d interpolate(const Pose2d& from, const Pose2d& to, double ratio) {
    return from * Pose2d::exp(ratio * between(from, to).log());
}

inline std::ostream& operator<<(std::ostream& out, const Pose2d& pose) {
    return out << "(" << pose.x() << " m, " << pose.y() << " m, " << degrees(pose.heading)
               << " deg)";
}

}  // namespace hybrid_slam

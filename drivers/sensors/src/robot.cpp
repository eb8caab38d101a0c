// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/sensors/robot.hpp"

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/lidar/lidar_reader.hpp"

namespace hybrid_slam {

void describe(ConfigSchema& schema, RobotConfig& robot) {
    schema.add("name", robot.name, "of the vehicle");
    {
        const ConfigSchema::Section section(schema, "lidar");
        describe(schema, robot.lidar);
    }
    {
        const ConfigSchema::Section section(schema, "camera");
        describe(schema, robot.camera);
    }
    {
        const ConfigSchema::Section section(schema, "vehicle");
        describe(schema, robot.vehicle);
    }
    const ConfigSchema::Section section(schema, "can");
    describe(schema, robot.can);
}

RobotConfig read_robot(const std::filesystem::path& file) {
    RobotConfig robot;
    ConfigSchema schema;
    describe(schema, robot);
    schema.load(file);
    try {
        const LidarReader checked(robot.lidar);  // what one key's range cannot say
    } catch (const Error& error) {
        throw Error(file.string() + ": " + error.what());
    }
    return robot;
}

std::string to_yaml(RobotConfig robot) {
    ConfigSchema schema;
    describe(schema, robot);
    return schema.to_yaml();
}

}  // namespace hybrid_slam

// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/sensors/robot.hpp"

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
    const ConfigSchema::Section section(schema, "vehicle");
    describe(schema, robot.vehicle);
}

RobotConfig read_robot(const std::filesystem::path& file) {
    RobotConfig robot;
    ConfigSchema schema;
    describe(schema, robot);
    schema.load(file);
    return robot;
}

std::string to_yaml(RobotConfig robot) {
    ConfigSchema schema;
    describe(schema, robot);
    return schema.to_yaml();
}

}  // namespace hybrid_slam
